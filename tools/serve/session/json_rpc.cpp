#include "tools/serve/session/json_rpc.h"

#include "index/text.h"
#include "tools/words/answer.h"

#include <exception>
#include <new>

namespace filiform::tools {

namespace {

using RpcJson = nlohmann::json;

nlohmann::ordered_json failureOf(int code, const std::string& what) { return {{"code", code}, {"message", what}}; }

// Runs the method and names its error.
nlohmann::ordered_json outcomeOf(const RpcMethod& method, const std::string& name, const RpcJson& params) {
  try {
    return {{"result", method(name, params)}};
  } catch (const RpcError& error) {
    return {{"error", failureOf(error.code(), error.what())}};
  } catch (const Refusal& refusal) {
    const int code = refusal.status() == 503   ? RpcError::kBusy
                     : refusal.status() == 404 ? RpcError::kNotFound
                                               : RpcError::kParams;
    return {{"error", failureOf(code, refusal.what())}};
  } catch (const UsageError& error) {
    return {{"error", failureOf(RpcError::kParams, error.what())}};
  } catch (const std::bad_alloc&) {
    return {{"error", failureOf(RpcError::kBusy, "the server has no memory left; ask again")}};
  } catch (const Error&) {  // the texts of these name files of the server
    return {{"error", failureOf(RpcError::kUnreadable, "the set cannot be read; the server's log says why")}};
  } catch (const std::exception&) {
    return {{"error", failureOf(RpcError::kInternal, "the server failed; its log says why")}};
  }
}

// The answer to one call; null: a notification.
nlohmann::ordered_json answerCall(const RpcJson& call, const RpcMethod& method, RpcAnswer& answer) {
  ++answer.calls;
  nlohmann::ordered_json reply{{"jsonrpc", "2.0"}, {"id", nullptr}};
  const auto invalid = [&](const char* what) {
    ++answer.errors;
    reply["error"] = failureOf(RpcError::kInvalid, what);
    return reply;
  };
  if (!call.is_object()) return invalid("a request is an object");
  const auto id = call.find("id");
  const bool has_id = id != call.end();
  if (has_id && !id->is_string() && !id->is_number() && !id->is_null())
    return invalid("id must be a string, a number or null");
  if (has_id) reply["id"] = nlohmann::ordered_json(*id);
  const auto version = call.find("jsonrpc");
  if (version == call.end() || *version != "2.0") return invalid("jsonrpc must be \"2.0\"");
  const auto name = call.find("method");
  if (name == call.end() || !name->is_string()) return invalid("method must be a string");
  const auto params = call.find("params");
  if (params != call.end() && !params->is_object()) return invalid("params must be an object");
  for (const auto& [key, value] : call.items())
    if (key != "id" && key != "jsonrpc" && key != "method" && key != "params")
      return invalid("a request has only jsonrpc, method, params and id");
  const nlohmann::ordered_json outcome =
      outcomeOf(method, name->get<std::string>(), params == call.end() ? RpcJson::object() : *params);
  answer.errors += outcome.contains("error");
  if (!has_id) return nullptr;
  reply.update(outcome);
  return reply;
}

}  // namespace

RpcAnswer answerRpc(std::string_view text, const RpcMethod& method) {
  RpcAnswer answer;
  const RpcJson parsed = RpcJson::parse(text, nullptr, false);
  if (parsed.is_discarded() || (parsed.is_array() && (parsed.empty() || parsed.size() > kMostCalls))) {
    const bool is_json = !parsed.is_discarded();
    answer.calls = answer.errors = 1;
    answer.text = jsonText({{"jsonrpc", "2.0"},
                            {"id", nullptr},
                            {"error", failureOf(is_json ? RpcError::kInvalid : RpcError::kParse,
                                                is_json ? "a batch has 1 to 16 requests" : "the text is not JSON")}});
    return answer;
  }
  if (!parsed.is_array()) {
    const nlohmann::ordered_json reply = answerCall(parsed, method, answer);
    if (!reply.is_null()) answer.text = jsonText(reply);
    return answer;
  }
  nlohmann::ordered_json replies = nlohmann::ordered_json::array();
  for (const RpcJson& call : parsed) {
    nlohmann::ordered_json reply = answerCall(call, method, answer);
    if (!reply.is_null()) replies.push_back(std::move(reply));
  }
  if (!replies.empty()) answer.text = jsonText(replies);
  return answer;
}

std::string rpcNotification(const std::string& method, const nlohmann::ordered_json& params) {
  return jsonText({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
}

}  // namespace filiform::tools
