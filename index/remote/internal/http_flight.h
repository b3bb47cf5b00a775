// HttpFlight: one request to a server, from its preparation to the judgement of its answer.
#pragma once

#include "index/remote/internal/http_job.h"
#include "index/remote/internal/http_landing.h"
#include "index/remote/internal/s3_account.h"

#include <array>
#include <cstdint>
#include <curl/curl.h>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

struct HttpFlightOptions {
  std::string token;                   // empty: none
  const S3Account* account = nullptr;  // signs requests with its keys; must live as long as the flight
  unsigned stall_s = 5;
  double deadline_s = 20;
};

// Thread rule: thread-compatible.
class HttpFlight {
 public:
  HttpFlight();
  HttpFlight(const HttpFlight&) = delete;
  HttpFlight& operator=(const HttpFlight&) = delete;

  CURL* handle() { return easy_.get(); }
  // Prepares a request for `url` that serves all jobs: one job, or ranges of one file that lie close together. The jobs
  // must live until land().
  void prepare(std::vector<HttpJob*> jobs, const std::string& url, const HttpFlightOptions& options);
  // Judges the answer. `code`: how the transfer ended.
  HttpLanding land(CURLcode code);

  const std::vector<HttpJob*>& jobs() const { return jobs_; }
  std::uint64_t received() const { return received_; }  // bytes of the body
  int redirects = 0;

 private:
  std::size_t takeHeader(std::string_view line);
  std::size_t takeBody(std::span<const std::uint8_t> data);
  bool keep(std::span<const std::uint8_t> data);
  bool succeeded() const;
  bool isCoded() const { return !coding_.empty() && coding_ != "identity"; }
  HttpLanding judgeStatus() const;
  HttpLanding judgeStore(HttpLanding otherwise) const;
  HttpLanding judgeRange() const;
  HttpLanding judgeFailure(CURLcode code) const;

  struct FreeEasy {
    void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
  };
  struct FreeList {
    void operator()(curl_slist* list) const { curl_slist_free_all(list); }
  };
  std::unique_ptr<CURL, FreeEasy> easy_;
  std::unique_ptr<curl_slist, FreeList> headers_;
  std::array<char, CURL_ERROR_SIZE> error_{};
  std::vector<HttpJob*> jobs_;
  bool has_token_ = false;
  const S3Account* account_ = nullptr;
  std::string error_body_, date_, region_;  // of an answer with an error, from an object store
  std::string tag_, digest_;
  std::string coding_;                 // Content-Encoding of the answer, which libcurl undoes
  std::uint64_t first_ = 0, end_ = 0;  // of the range that is asked for
  long status_ = 0;
  bool has_range_ = false;                        // the answer has a valid Content-Range
  std::uint64_t range_first_ = 0, range_of_ = 0;  // from it; of: size of the file, 0 if unknown
  std::uint64_t at_ = 0;                          // offset in the file of the next byte of the body
  std::uint64_t received_ = 0;
  bool begun_ = false, stopped_ = false;  // stopped: the rest of the body is not needed, or not wanted
  bool too_long_ = false;
};

}  // namespace filiform::internal
