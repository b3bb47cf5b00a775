#include "index/remote/internal/http_flight.h"

#include "index/remote/internal/s3_answer.h"
#include "index/text.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>
#include <string_view>

namespace filiform::internal {
namespace {

// Of a server that ignores Range and sends the whole file: at most this much is read to reach the end of a range.
constexpr std::uint64_t kMostSkipped = std::uint64_t{16} << 20;
constexpr std::uint64_t kMostErrorBody = std::uint64_t{64} << 10;
constexpr std::size_t kMostErrorText = 4096;
constexpr unsigned kSendStall_s = 60;  // a store may think about what it was sent
constexpr double kSlowest_bytes_s = 64 << 10;

template <typename Value>
void setOption(CURL* easy, CURLoption option, Value value) {
  if (curl_easy_setopt(easy, option, value) == CURLE_OUT_OF_MEMORY) throw std::bad_alloc();
}

bool takeNumber(std::string_view& text, std::uint64_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool takeLetter(std::string_view& text, char letter) {
  if (text.empty() || text.front() != letter) return false;
  text.remove_prefix(1);
  return true;
}

// Removes the name of a header and the blanks after it.
bool takeName(std::string_view& line, std::string_view name) {
  if (line.size() < name.size() || !endsWithNoCase(line.substr(0, name.size()), name)) return false;
  line.remove_prefix(name.size());
  while (takeLetter(line, ' ') || takeLetter(line, '\t')) {
  }
  return true;
}

bool isPassing(long status) {
  return status == 304 || status == 408 || status == 425 || status == 429 ||
         (status >= 500 && status != 501 && status != 505);
}

}  // namespace

HttpFlight::HttpFlight() : easy_(curl_easy_init()) {
  if (easy_ == nullptr) throw std::bad_alloc();
}

void HttpFlight::prepare(std::vector<HttpJob*> jobs, const std::string& url, const HttpFlightOptions& options) {
  jobs_ = std::move(jobs);
  account_ = options.account;
  has_token_ = account_ == nullptr && !options.token.empty();
  for (std::string* const text : {&error_body_, &date_, &region_, &tag_, &digest_, &coding_}) text->clear();
  status_ = 0;
  at_ = received_ = range_first_ = range_of_ = 0;
  begun_ = stopped_ = too_long_ = has_range_ = false;
  error_.fill('\0');
  first_ = UINT64_MAX, end_ = 0;
  for (const HttpJob* job : jobs_) first_ = std::min(first_, job->offset), end_ = std::max(end_, job->end());
  for (HttpJob* job : jobs_) job->whole.clear();

  const HttpJob& first = *jobs_.front();
  const std::size_t transfer = first.kind == HttpJob::Kind::send ? first.body.size() : end_ - first_;
  CURL* const easy = easy_.get();
  curl_easy_reset(easy);
  setOption(easy, CURLOPT_URL, url.c_str());
  setOption(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  setOption(easy, CURLOPT_NOSIGNAL, 1L);
  setOption(easy, CURLOPT_TCP_KEEPALIVE, 1L);
  setOption(easy, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_2TLS));
  setOption(easy, CURLOPT_USERAGENT, "filiform");
  // Parts of a file are parts of its plain bytes. With this option libcurl undoes a coding that the server uses all the
  // same, as object stores do with what was stored packed.
  setOption(easy, CURLOPT_ACCEPT_ENCODING, "identity");
  // As OpenSSL's own programs: the certificates of a lab's own authority.
  if (const char* const authorities = std::getenv("SSL_CERT_FILE"); authorities != nullptr && *authorities != '\0')
    setOption(easy, CURLOPT_CAINFO, authorities);
  if (account_ != nullptr && !account_->authorities.empty())
    setOption(easy, CURLOPT_CAINFO, account_->authorities.c_str());
  setOption(easy, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(std::max(1.0, 500 * options.deadline_s)));
  setOption(
      easy, CURLOPT_TIMEOUT_MS,
      static_cast<long>(std::min(1e9, 1000 * (options.deadline_s + static_cast<double>(transfer) / kSlowest_bytes_s))));
  setOption(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  setOption(easy, CURLOPT_LOW_SPEED_TIME,
            static_cast<long>(std::max(first.kind == HttpJob::Kind::send ? kSendStall_s : 1u, options.stall_s)));
  setOption(easy, CURLOPT_ERRORBUFFER, error_.data());
  setOption(easy, CURLOPT_PRIVATE, this);
  using Take = std::size_t (*)(char*, std::size_t, std::size_t, void*);
  const Take header = [](char* data, std::size_t, std::size_t n, void* self) {
    return static_cast<HttpFlight*>(self)->takeHeader({data, n});
  };
  const Take body = [](char* data, std::size_t, std::size_t n, void* self) {
    return static_cast<HttpFlight*>(self)->takeBody({reinterpret_cast<const std::uint8_t*>(data), n});
  };
  setOption(easy, CURLOPT_HEADERFUNCTION, header);
  setOption(easy, CURLOPT_HEADERDATA, static_cast<void*>(this));
  setOption(easy, CURLOPT_WRITEFUNCTION, body);
  setOption(easy, CURLOPT_WRITEDATA, static_cast<void*>(this));

  headers_.reset();
  const auto add = [this](const std::string& line) {
    curl_slist* const longer = curl_slist_append(headers_.get(), line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    (void)headers_.release();
    headers_.reset(longer);
  };
  if (has_token_) add("Authorization: Bearer " + options.token);
  if (account_ != nullptr && account_->hasKeys()) {
    setOption(easy, CURLOPT_AWS_SIGV4, ("aws:amz:" + account_->region + ":s3").c_str());
    setOption(easy, CURLOPT_USERNAME, account_->access_key.c_str());
    setOption(easy, CURLOPT_PASSWORD, account_->secret_key.c_str());
    add("x-amz-content-sha256: UNSIGNED-PAYLOAD");  // libcurl signs it, but does not add it
    if (!account_->session_token.empty()) add("x-amz-security-token: " + account_->session_token);
  }
  // CURRENT changes; an answer of 304 to a request without conditions comes from a faulty cache.
  if (first.kind == HttpJob::Kind::whole || first.attempts > 0) add("Cache-Control: no-cache");
  if (first.kind == HttpJob::Kind::send) {
    add("Content-Type: application/octet-stream");
    for (const std::string& line : first.headers) add(line);
    setOption(easy, CURLOPT_CUSTOMREQUEST, first.method.c_str());
    setOption(easy, CURLOPT_POSTFIELDS, first.body.empty() ? "" : reinterpret_cast<const char*>(first.body.data()));
    setOption(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(first.body.size()));
  }
  setOption(easy, CURLOPT_HTTPHEADER, headers_.get());
  if (first.kind == HttpJob::Kind::size) setOption(easy, CURLOPT_NOBODY, 1L);
  if (first.kind == HttpJob::Kind::range)
    setOption(easy, CURLOPT_RANGE, (std::to_string(first_) + "-" + std::to_string(end_ - 1)).c_str());
}

// "Content-Range: bytes FIRST-LAST/SIZE", SIZE may be *; "bytes */SIZE" with status 416.
std::size_t HttpFlight::takeHeader(std::string_view line) {
  const std::size_t taken = line.size();
  if (line.starts_with("HTTP/")) {  // another answer, after an interim one
    has_range_ = false;
    range_first_ = range_of_ = 0;
    coding_.clear();
  }
  if (takeName(line, "content-encoding:")) {
    coding_ = lowerCase(line.substr(0, line.find_last_not_of(" \t\r\n") + 1));
    return taken;
  }
  if (account_ != nullptr && takeName(line, "date:")) {
    date_ = line;
    return taken;
  }
  for (const auto& [name, text] : {std::pair<std::string_view, std::string*>{"x-amz-bucket-region:", &region_},
                                   {"x-amz-meta-xxh3:", &digest_},
                                   {"etag:", &tag_}})
    if (account_ != nullptr && takeName(line, name)) {
      *text = line.substr(0, line.find_last_not_of(" \t\r\n") + 1);
      return taken;
    }
  if (!takeName(line, "content-range:")) return taken;
  if (!line.starts_with("bytes ")) return taken;
  line.remove_prefix(6);
  std::uint64_t last = 0;
  if (takeLetter(line, '*')) {
    if (takeLetter(line, '/')) takeNumber(line, range_of_);
    return taken;
  }
  has_range_ = takeNumber(line, range_first_) && takeLetter(line, '-') && takeNumber(line, last) &&
               takeLetter(line, '/') && last >= range_first_;
  if (has_range_) takeNumber(line, range_of_);
  return taken;
}

// Returns less than the size of `data` to end the transfer.
std::size_t HttpFlight::takeBody(std::span<const std::uint8_t> data) {
  if (!begun_) {
    begun_ = true;
    curl_easy_getinfo(easy_.get(), CURLINFO_RESPONSE_CODE, &status_);
    at_ = status_ == 206 ? range_first_ : 0;
  }
  received_ += data.size();
  stopped_ = !keep(data);
  return stopped_ ? 0 : data.size();
}

bool HttpFlight::succeeded() const {
  return jobs_.front()->kind == HttpJob::Kind::send ? status_ >= 200 && status_ < 300 : status_ == 200;
}

// Keeps what the jobs need. Returns false if no more is needed or wanted.
bool HttpFlight::keep(std::span<const std::uint8_t> data) {
  if (status_ != 206 && !succeeded()) {
    if (account_ != nullptr && error_body_.size() < kMostErrorText) error_body_.append(data.begin(), data.end());
    return received_ <= kMostErrorBody;
  }
  HttpJob& first = *jobs_.front();
  if (first.kind == HttpJob::Kind::whole || first.kind == HttpJob::Kind::send) {
    too_long_ = data.size() > first.most - first.whole.size();
    if (!too_long_) first.whole.insert(first.whole.end(), data.begin(), data.end());
    return !too_long_;
  }
  if (status_ == 206 && (!has_range_ || range_first_ != first_)) return false;
  too_long_ = status_ == 200 && end_ > kMostSkipped;
  if (too_long_) return false;
  for (HttpJob* const job : jobs_) {
    const std::uint64_t from = std::max(at_, job->offset), to = std::min(at_ + data.size(), job->end());
    if (from < to) std::memcpy(job->bytes.data() + (from - job->offset), data.data() + (from - at_), to - from);
  }
  at_ += data.size();
  return at_ < end_ || (at_ == end_ && status_ == 206);
}

HttpLanding HttpFlight::land(CURLcode code) {
  curl_easy_getinfo(easy_.get(), CURLINFO_RESPONSE_CODE, &status_);
  if (code == CURLE_OUT_OF_MEMORY) throw std::bad_alloc();
  const bool only_size = jobs_.front()->kind == HttpJob::Kind::size;
  if (isCoded() && (status_ == 206 || (only_size && status_ == 200)))
    return {.kind = HttpLanding::Kind::refused,
            .what = "the server sends it packed (Content-Encoding: " + escaped(coding_, 20) +
                    "), so that parts of it cannot be read",
            .remedy = "store it without Content-Encoding, or serve it unpacked"};
  const bool answered = status_ != 0 && (code == CURLE_OK || stopped_);
  if (!answered) return judgeFailure(code);
  const HttpJob::Kind kind = jobs_.front()->kind;
  if (kind == HttpJob::Kind::range && (status_ == 200 || status_ == 206 || status_ == 416)) return judgeRange();
  if (!succeeded()) return judgeStatus();
  if (too_long_)
    return {.kind = HttpLanding::Kind::refused,
            .what = "has more than " + std::to_string(jobs_.front()->most) + " bytes",
            .remedy = "check the address"};
  if (kind == HttpJob::Kind::size) {
    curl_off_t length = -1;
    curl_easy_getinfo(easy_.get(), CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
    if (length < 0)
      return {.kind = HttpLanding::Kind::refused,
              .what = "the server does not state its size",
              .remedy = "serve the set with another server"};
    jobs_.front()->size = static_cast<std::uint64_t>(length);
    jobs_.front()->digest = digest_;
  }
  jobs_.front()->tag = tag_;
  return {};
}

HttpLanding HttpFlight::judgeRange() const {
  if (status_ == 416) return {.kind = HttpLanding::Kind::ends, .file_bytes = range_of_};
  if (too_long_)
    return {.kind = HttpLanding::Kind::refused,
            .what = "the server ignores Range and sends the whole file",
            .remedy = "serve the set with a server that answers ranges (206), such as nginx or filiform serve"};
  if (status_ == 206 && (!has_range_ || range_first_ != first_))
    return {.kind = HttpLanding::Kind::refused,
            .what = "the server answered with other bytes than those asked for",
            .remedy = "serve the set with another server"};
  if (at_ >= end_) return {};
  // A server that states the size of the file, and that this is larger, has cut its answer.
  if (status_ == 206 && range_of_ >= end_)
    return {.kind = HttpLanding::Kind::retry, .what = "the server cut its answer short"};
  return {.kind = HttpLanding::Kind::ends, .file_bytes = at_};
}

HttpLanding HttpFlight::judgeStatus() const {
  const std::string status = std::to_string(status_);
  HttpLanding landing;
  char* target = nullptr;
  if (status_ == 301 || status_ == 302 || status_ == 303 || status_ == 307 || status_ == 308) {
    curl_easy_getinfo(easy_.get(), CURLINFO_REDIRECT_URL, &target);
    if (target != nullptr) return {.kind = HttpLanding::Kind::redirect, .target = target};
  }
  landing.kind = isPassing(status_) ? HttpLanding::Kind::retry : HttpLanding::Kind::refused;
  landing.what = "the server answered " + status;
  landing.remedy = "check the address and the server";
  if (status_ == 401) {
    landing.what = has_token_ ? "the server does not accept the token (401)" : "the server asks for a token (401)";
    landing.remedy =
        has_token_ ? "check the token" : "give --token-file FILE (serve: --source-token-file) or FILIFORM_TOKEN";
  } else if (status_ == 403) {
    landing.kind = HttpLanding::Kind::denied;
    landing.what = "the server refuses access (403)";
    landing.remedy = "ask its owner, or give another token";
  } else if (status_ == 404 || status_ == 410) {
    landing.kind = HttpLanding::Kind::missing;
    landing.what = "is not on the server (" + status + ")";
  } else if (isPassing(status_)) {
    curl_off_t wait_s = 0;
    curl_easy_getinfo(easy_.get(), CURLINFO_RETRY_AFTER, &wait_s);
    landing.wait_s = static_cast<double>(wait_s);
    landing.remedy = wait_s > 0 ? "try again in " + std::to_string(wait_s) + " s" : "try again later";
    if (status_ == 429) landing.what = "the server limits the number of requests (429)";
  }
  return account_ != nullptr ? judgeStore(std::move(landing)) : landing;
}

HttpLanding HttpFlight::judgeStore(HttpLanding otherwise) const {
  S3Answer answer{.status = status_, .body = error_body_, .region = region_};
  if (const std::time_t there = curl_getdate(date_.c_str(), nullptr); there != -1)
    answer.clock_ahead_s = std::difftime(std::time(nullptr), there);
  return judgeS3(answer, *account_, std::move(otherwise));
}

HttpLanding HttpFlight::judgeFailure(CURLcode code) const {
  HttpLanding landing;
  const std::string reason = escaped(error_.front() != '\0' ? error_.data() : curl_easy_strerror(code), 200);
  switch (code) {
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_SSL_CERTPROBLEM:
    case CURLE_SSL_CIPHER:
    case CURLE_URL_MALFORMAT:
    case CURLE_UNSUPPORTED_PROTOCOL:
      landing.kind = HttpLanding::Kind::refused;
      landing.remedy = "check the address and the server's certificate";
      break;
    case CURLE_BAD_CONTENT_ENCODING:
    case CURLE_WRITE_ERROR:  // of libcurl's decoder, for bytes behind the end: takeBody() sets stopped_
      landing.kind = HttpLanding::Kind::refused;
      landing.remedy = "its Content-Encoding (" + escaped(coding_, 20) + ") is damaged or not known; store it again";
      break;
    default:
      landing.kind = HttpLanding::Kind::retry;
      landing.remedy = "check the address and the network";
  }
  landing.what = "cannot be read: " + reason;
  return landing;
}

}  // namespace filiform::internal
