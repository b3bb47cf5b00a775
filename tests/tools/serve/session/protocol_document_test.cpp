// Replays the worked exchange of tools/serve/PROTOCOL.md, from the document itself.
#include "tests/support/folders.h"
#include "tests/support/servers/served_sets.h"
#include "tests/support/temp_folder.h"
#include "tools/serve/session/session_client.h"

#include <cctype>
#include <chrono>
#include <fstream>
#include <regex>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

struct DocumentLine {
  bool sent = false, binary = false;
  std::string text;  // of a binary line: two characters a byte, without blanks
};

std::vector<DocumentLine> exchangeOf(const std::string& document) {
  std::vector<DocumentLine> lines;
  std::istringstream in(document.substr(document.find("## A worked exchange")));
  std::string fence;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) {
      fence = fence.empty() ? line.substr(3) : "";
    } else if (fence == "text") {
      lines.push_back({line[0] == '>', false, line.substr(2)});
    } else if (fence == "hex") {
      if (line[0] != ' ') lines.push_back({line[0] == '>', true, ""});
      for (const char c : line.substr(1))
        if (c != ' ') lines.back().text += c;
    }
  }
  return lines;
}

std::string hexOf(std::span<const unsigned char> bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string hex;
  for (const unsigned char byte : bytes) (hex += kDigits[byte >> 4]) += kDigits[byte & 15];
  return hex;
}

bool fits(const std::string& pattern, const std::string& text) {
  std::string expression;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern.compare(i, 3, "...") == 0) {
      expression += ".*";
      i += 2;
    } else {
      if (std::isalnum(static_cast<unsigned char>(pattern[i])) == 0) expression += '\\';
      expression += pattern[i];
    }
  }
  return std::regex_match(text, std::regex(expression));
}

TEST(ProtocolDocument, TheWorkedExchangeHappens) {
  const test::ServedSets sets;
  SessionHouse house(*sets.shelf, {});
  SessionClient client(house, "0.0.0");
  const std::vector<DocumentLine> lines = exchangeOf(test::readBytes(test::inSource("tools/serve/PROTOCOL.md")));
  ASSERT_EQ(lines.size(), 12u);
  std::string answer;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (const DocumentLine& line : lines) {
    if (!line.binary) {
      if (line.sent)
        answer = client.answer(line.text);
      else
        EXPECT_TRUE(fits(line.text, answer)) << line.text << '\n' << answer;
      continue;
    }
    if (line.sent) {
      // Once the jump was made.
      while (client.answer(R"({"jsonrpc":"2.0","id":0,"method":"workspace"})").find("\"place\":null") !=
             std::string::npos) {
        ASSERT_LT(std::chrono::steady_clock::now(), until);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      std::vector<unsigned char> bytes;
      for (std::size_t i = 0; i < line.text.size(); i += 2)
        bytes.push_back(static_cast<unsigned char>(std::stoi(line.text.substr(i, 2), nullptr, 16)));
      ASSERT_EQ(bytes.size(), std::size_t{v1::kHandBytes});
      EXPECT_FALSE(client.receive(bytes));
      continue;
    }
    std::string hex;
    while (hex.empty()) {
      ASSERT_LT(std::chrono::steady_clock::now(), until);
      client.takeFrames([&](std::span<const unsigned char> bytes) {
        if (bytes.size() == v1::kProxyBytes) hex = hexOf(bytes);
      });
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_EQ(hex.size(), line.text.size());
    for (std::size_t i = 0; i < hex.size(); ++i)
      if (line.text[i] != '?') {
        EXPECT_EQ(hex[i], line.text[i]) << "byte " << i / 2 << " of " << hex;
      }
  }
}

}  // namespace
}  // namespace filiform::tools
