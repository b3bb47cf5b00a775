// Secrets: texts that open a server. Functions without state.
#pragma once

#include <string>
#include <string_view>

namespace filiform::tools {

// 128 random bits as hexadecimal digits. Throws IoError.
std::string randomText();

// Takes the same time for each text of the same length. False for an empty secret.
bool isSecret(std::string_view text, std::string_view secret);

// True for 16 to 512 visible characters of ASCII, without `;` `,` `"` `\`.
bool isFitToken(std::string_view text);

// Reads the token of an option's file as readTokenFile() does (token.h), and checks that it is a fit one. Throws
// IoError, UsageError.
std::string readToken(const std::string& option, const std::string& path);

}  // namespace filiform::tools
