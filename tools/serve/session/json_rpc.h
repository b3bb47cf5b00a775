// JSON-RPC 2.0: from the text of a request to the text of its answer. Functions without state.
#pragma once

#include "index/errors.h"

#include <functional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace filiform::tools {

class RpcError : public Error {
 public:
  static constexpr int kParse = -32700, kInvalid = -32600, kNoMethod = -32601, kParams = -32602, kInternal = -32603;
  static constexpr int kOutOfOrder = -32001;  // hello or open must come first
  static constexpr int kBusy = -32002;        // too many sessions, or no time left
  static constexpr int kNotFound = -32003;    // no such set, cell, sample or place
  static constexpr int kUnreadable = -32004;  // the set is damaged, or cannot be read

  RpcError(int code, const std::string& what) : Error(what), code_(code) {}
  int code() const { return code_; }

 private:
  int code_;
};

inline constexpr std::size_t kMostCalls = 16;  // in a batch

struct RpcAnswer {
  std::string text;        // empty: there is none
  std::size_t errors = 0;  // of the calls
  std::size_t calls = 0;
};

using RpcMethod = std::function<nlohmann::ordered_json(const std::string& method, const nlohmann::json& params)>;

// Calls `method` for each request of the text (one, or a batch of up to 16) and returns its answer. `params` is an
// object, empty if there are none. Errors become answers: RpcError with its code; UsageError as kParams; a Refusal and
// errors of a set with the codes above. Text of the request that an answer repeats is escaped. O(length).
RpcAnswer answerRpc(std::string_view text, const RpcMethod& method);

// A notification from the server.
std::string rpcNotification(const std::string& method, const nlohmann::ordered_json& params);

}  // namespace filiform::tools
