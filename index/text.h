// Makes text from files safe for terminals, tables and messages, and bytes safe inside a text. Thread rule: pure
// functions, any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace filiform {

// Escapes everything that could control a terminal or break a table. Control characters become \t, \n, \r or \xNN; C1
// controls and bidirectional overrides become \uNNNN; bytes that are not UTF-8 become \xNN. Printable text and
// backslashes stay. O(length).
std::string escaped(std::string_view text);

// Escapes at most `limit` bytes of input, cut at a whole character. Appends "..." if something was cut.
std::string escaped(std::string_view text, std::size_t limit);

// What a user or a file gave, for a message: escaped(). Of more than 200 bytes it keeps the beginning and the end, with
// "..." between: 200 bytes before escaping. O(1).
std::string inShort(std::string_view text);
// The same for a whole message, which escaped() has left safe: each run of more than 200 bytes without a blank is cut
// as by inShort(). O(length).
std::string withShortWords(std::string_view message);

// The first character of a text. `length` in bytes; 0 if the text does not begin with well-formed UTF-8.
struct Utf8Character {
  std::size_t length = 0;
  char32_t code_point = 0;
};
// Decodes the first character of `text`, without overlong forms or surrogates. Requires that `text` is not empty. O(1).
Utf8Character decodeUtf8(std::string_view text);

// True if `text` is well-formed UTF-8, without overlong forms or surrogates. O(length).
bool isUtf8(std::string_view text);

// `text` with the ASCII letters in lower case. O(length).
std::string lowerCase(std::string_view text);
// Base64 (RFC 4648, section 4, with padding). O(bytes).
std::string toBase64(std::string_view bytes);
// Reverses toBase64(). Returns nullopt for a text that toBase64() does not give. O(length).
std::optional<std::string> fromBase64(std::string_view text);

// True if `name` ends in `suffix`, in any letter case. Requires a lower-case ASCII `suffix`.
bool endsWithNoCase(std::string_view name, std::string_view suffix);

}  // namespace filiform
