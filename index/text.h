// Text that came from files, made safe for terminals, tables and messages. Immutable functions, any thread.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace filiform {

// `text` with everything that could steer a terminal or break a table written out: control characters as \t, \n, \r or
// \xNN, C1 controls and bidirectional overrides as \uNNNN, bytes that are not UTF-8 as \xNN. Printable text,
// backslashes too, is left alone. O(length).
std::string escaped(std::string_view text);

// The same, cut at a whole character to at most `limit` bytes of input, with "..." where something was left out.
std::string escaped(std::string_view text, std::size_t limit);

// Is `text` well-formed UTF-8 (no overlong forms, no surrogates)? O(length).
bool isUtf8(std::string_view text);

// Does `name` end in `suffix`, a lower-case ASCII text, in any letter case?
bool endsWithNoCase(std::string_view name, std::string_view suffix);

}  // namespace filiform
