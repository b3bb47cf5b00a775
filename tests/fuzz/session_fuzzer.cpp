#include "tests/fuzz/fuzz_bytes.h"
#include "tools/serve/session/hand_path.h"
#include "tools/serve/session/json_rpc.h"
#include "tools/serve/session/outbox.h"
#include "tools/serve/session/protocol.h"
#include "tools/serve/session/remote_hand.h"

#include <cstring>
#include <string>

namespace filiform::fuzz {

namespace {

// A client that sends these frames: the hand stays finite and within its limits.
void fuzzFrames(Input input) {
  tools::RemoteHand hand({});
  tools::Outbox outbox;
  hand.open();
  std::uint64_t period = 0;
  for (std::size_t at = 0; at < input.size(); at += v1::kHandBytes) {
    const Input rest = input.subspan(at);
    v1::Hand frame;
    const std::size_t size = std::min<std::size_t>(rest.size(), v1::kHandBytes);
    const bool is_hand = v1::decode(rest.data(), size, frame);
    unsigned char again[v1::kHandBytes];
    if (is_hand) {
      v1::encode(frame, again);
      v1::Hand twice;
      require(v1::decode(again, sizeof again, twice) && twice.seq == frame.seq && twice.ack == frame.ack,
              "a HAND comes back as it was");
      hand.receive(frame);
      outbox.acknowledge(frame.ack);
    }
    period += 1 + rest[0] % 200;
    hand.beginPeriod(period);
    const DeviceState state = hand.exchange({});
    require(state.p_D.allFinite() && state.p_D.cwiseAbs().maxCoeff() <= tools::RemoteHand::kMost_m * 1.0001,
            "the hand is finite and within its limits");
    require(state.twist_D.allFinite(), "rates are finite");
    outbox.put({});
    outbox.next();
  }
  v1::Proxy proxy;
  v1::decode(input.data(), input.size(), proxy);
  v1::ModelHead model;
  if (v1::decode(input.data(), input.size(), model))
    require(input.size() == v1::modelBytes(model), "a model has its nodes and links");
}

}  // namespace

void fuzzSession(Input input) {
  const std::string text(asText(input));
  const tools::RpcAnswer answer =
      tools::answerRpc(text, [](const std::string& method, const nlohmann::json& params) -> nlohmann::ordered_json {
        require(params.is_object(), "params are an object");
        if (method.size() > 3) throw tools::RpcError(tools::RpcError::kNoMethod, "unknown");
        return {{"params", params.size()}};
      });
  require(answer.errors <= answer.calls && answer.calls <= tools::kMostCalls, "a batch keeps its limit");
  if (!answer.text.empty()) {
    const nlohmann::json parsed = nlohmann::json::parse(answer.text, nullptr, false);
    require(!parsed.is_discarded(), "an answer is JSON");
    for (const char c : answer.text) require(c >= 0x20 && c < 0x7f, "an answer is ASCII without control bytes");
  }
  fuzzFrames(input);
}

}  // namespace filiform::fuzz
