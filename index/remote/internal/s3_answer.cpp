#include "index/remote/internal/s3_answer.h"

#include "index/text.h"

#include <cmath>
#include <string_view>

namespace filiform::internal {
namespace {

constexpr const char* kReplaced = "; if the set was replaced meanwhile, open it again";

std::string clockText(const std::optional<double>& ahead_s) {
  if (!ahead_s || std::abs(*ahead_s) < 60) return "this machine's clock differs from the store's";
  return "this machine's clock is " + std::to_string(static_cast<long>(std::lround(std::abs(*ahead_s) / 60))) +
         " minutes " + (*ahead_s > 0 ? "ahead of" : "behind") + " the store's";
}

}  // namespace

std::string xmlText(std::string_view xml, std::string_view name) {
  const std::string open = "<" + std::string(name) + ">", close = "</" + std::string(name) + ">";
  const std::size_t begin = xml.find(open);
  if (begin == std::string_view::npos) return {};
  const std::size_t from = begin + open.size(), end = xml.find(close, from);
  return end == std::string_view::npos ? "" : std::string(xml.substr(from, end - from));
}

HttpLanding judgeS3(const S3Answer& answer, const S3Account& account, HttpLanding landing) {
  const std::string code = escaped(xmlText(answer.body, "Code"), 64);
  const std::string shown = " (" + std::to_string(answer.status) + (code.empty() ? "" : " " + code) + ")";
  const auto refuse = [&](const std::string& what, const std::string& remedy) {
    landing.kind = HttpLanding::Kind::refused;
    landing.what = what + shown;
    landing.remedy = remedy;
    return landing;
  };
  if (code == "RequestTimeTooSkewed") return refuse(clockText(answer.clock_ahead_s), "set this machine's clock");
  if (code == "ExpiredToken" || code == "TokenRefreshRequired")
    return refuse("the keys have expired", "get new ones, and set them with their AWS_SESSION_TOKEN");
  if (code == "InvalidToken")
    return refuse("the store does not accept AWS_SESSION_TOKEN", "set the token that belongs to the keys, or none");
  if (code == "InvalidAccessKeyId")
    return refuse("the store does not know the access key", "check AWS_ACCESS_KEY_ID or AWS_PROFILE, and the endpoint");
  if (code == "SignatureDoesNotMatch")
    return refuse("the store does not accept the signature", "check AWS_SECRET_ACCESS_KEY or AWS_PROFILE");
  if (code == "NoSuchBucket")
    return refuse("the store has no such bucket", "check the bucket's name and AWS_ENDPOINT_URL");
  if (code == "AuthorizationHeaderMalformed" || code == "PermanentRedirect" || answer.status == 301) {
    std::string region = answer.region.empty() ? xmlText(answer.body, "Region") : answer.region;
    region = escaped(region, 64);
    return refuse("the bucket is not in the region " + inShort(account.region),
                  region.empty() ? "set AWS_REGION to the bucket's region" : "set AWS_REGION=" + region);
  }
  if (answer.status == 403) {
    const auto deny = [&](const std::string& what, const std::string& remedy) {
      refuse(what, remedy);
      landing.kind = HttpLanding::Kind::denied;
      return landing;
    };
    if (!account.hasKeys())
      return deny("the store does not give this without keys, or does not have it",
                  "set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_PROFILE" + std::string(kReplaced));
    return deny("the store refuses access with these keys, or does not have this",
                "check the name, and what the keys allow" + std::string(kReplaced));
  }
  if (code == "SlowDown" || code == "RequestLimitExceeded") landing.what = "the store asks for fewer requests" + shown;
  if (landing.kind == HttpLanding::Kind::missing)
    landing.what = "is not in the bucket" + shown;
  else if (!code.empty() && landing.what.find('(') == std::string::npos)
    landing.what += " " + code;
  return landing;
}

}  // namespace filiform::internal
