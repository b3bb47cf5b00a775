#include "tools/serve/session/json_rpc.h"

#include "tools/words/refusal.h"

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

nlohmann::ordered_json twice(const std::string& method, const nlohmann::json& params) {
  if (method == "refuse") throw Refusal(503, "busy");
  if (method == "usage") throw UsageError("wrong");
  if (method == "damaged") throw CorruptSet("file", 0, "bad");
  if (method == "broken") throw std::logic_error("oh");
  return {{"method", method}, {"size", params.size()}};
}

nlohmann::json answered(const std::string& text) {
  const RpcAnswer answer = answerRpc(text, twice);
  return answer.text.empty() ? nlohmann::json() : nlohmann::json::parse(answer.text);
}
int codeOf(const std::string& text) { return answered(text).at("error").at("code").get<int>(); }
std::string call(const std::string& method) { return R"({"jsonrpc":"2.0","id":1,"method":")" + method + "\"}"; }

TEST(JsonRpc, AnswersRequestsAndBatches) {
  EXPECT_EQ(answered(R"({"jsonrpc":"2.0","id":"a","method":"m","params":{"x":1}})").dump(),
            R"({"id":"a","jsonrpc":"2.0","result":{"method":"m","size":1}})");
  EXPECT_TRUE(answered(R"({"jsonrpc":"2.0","method":"m"})").is_null());  // a notification
  const auto batch = answered("[" + call("a") + ",1,{\"jsonrpc\":\"2.0\",\"method\":\"quiet\"}]");
  ASSERT_EQ(batch.size(), 2u);
  EXPECT_EQ(batch[0].at("result").at("method"), "a");
  EXPECT_EQ(batch[1].at("error").at("code"), RpcError::kInvalid);
}

TEST(JsonRpc, NamesEveryError) {
  EXPECT_EQ(codeOf("{"), RpcError::kParse);
  EXPECT_EQ(codeOf("\xff"), RpcError::kParse);
  EXPECT_EQ(codeOf("[]"), RpcError::kInvalid);
  EXPECT_EQ(codeOf("7"), RpcError::kInvalid);
  EXPECT_EQ(codeOf(R"({"id":1,"method":"m"})"), RpcError::kInvalid);
  EXPECT_EQ(codeOf(R"({"jsonrpc":"2.0","id":1,"method":7})"), RpcError::kInvalid);
  EXPECT_EQ(codeOf(R"({"jsonrpc":"2.0","id":1,"method":"m","params":[1]})"), RpcError::kInvalid);
  EXPECT_EQ(codeOf(R"({"jsonrpc":"2.0","id":{},"method":"m"})"), RpcError::kInvalid);
  EXPECT_EQ(codeOf(R"({"jsonrpc":"2.0","id":1,"method":"m","more":1})"), RpcError::kInvalid);
  EXPECT_EQ(codeOf(call("refuse")), RpcError::kBusy);
  EXPECT_EQ(codeOf(call("usage")), RpcError::kParams);
  EXPECT_EQ(codeOf(call("damaged")), RpcError::kUnreadable);
  EXPECT_EQ(codeOf(call("broken")), RpcError::kInternal);
  EXPECT_EQ(answered(call("damaged")).dump().find("file"), std::string::npos) << "no file of the server is named";
  std::string many = "[1";
  for (int i = 0; i < 16; ++i) many += ",1";
  EXPECT_EQ(codeOf(many + "]"), RpcError::kInvalid);
}

TEST(JsonRpc, DeepTextIsNoTrouble) {
  EXPECT_EQ(codeOf(std::string(60000, '[')), RpcError::kParse);
  EXPECT_EQ(answered(std::string(30000, '[') + std::string(30000, ']')).size(), 1u);
}

}  // namespace
}  // namespace filiform::tools
