// Reads by the browser's own requests. Stands in for http_client.cpp in the preset `web`. A range has its own URL,
// FILE/FIRST-LAST: browsers keep it, and ask for several at once.
//
// No thread of its own: a caller makes the request that is next, which may be that of another caller.
#include "index/remote/internal/http_client.h"

#include "index/errors.h"
#include "index/remote/internal/answer_watch.h"
#include "index/remote/internal/background_reads.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/http_queue.h"
#include "index/remote/web/page_reader.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <emscripten/threading.h>
#include <mutex>
#include <optional>
#include <vector>

namespace filiform::internal {

namespace {

using Clock = HttpJob::Clock;

constexpr unsigned kMostRequests = 6;  // what browsers grant a host over HTTP/1.1
constexpr int kMostAttempts = 6;
constexpr double kFirstBackoff_s = 0.1, kLastBackoff_s = 2;

double secondsSince(Clock::time_point begun) { return std::chrono::duration<double>(Clock::now() - begun).count(); }

void askFor(PageRequest& request, Bytes& body) {
  request.to = body.data();
  request.room = static_cast<std::uint32_t>(body.size());
  ask(request);
}

bool isPassing(int status) { return status == 0 || status == 408 || status == 425 || status == 429 || status >= 500; }

}  // namespace

struct HttpClient::Impl {
  const std::string origin;
  const RemoteOptions options;
  std::mutex mutex;  // guards the members below
  std::condition_variable changed;
  HttpQueue queue;
  unsigned under_way = 0, background = 0;
  RemoteCounters counted;
  AnswerWatch watch;

  // Waits until the job is done. Makes requests meanwhile, for whichever jobs are next.
  void wait(HttpJob& job) {
    if (emscripten_is_main_browser_thread()) throw IoError(inShort(job.url), "cannot be read on the page's own thread");
    job.begun = Clock::now();
    job.background = BackgroundReads::active();
    std::unique_lock lock(mutex);
    queue.add(job);
    watch.readBegins(job.begun);
    while (!job.done) {
      const bool allowed = background < kMostRequests / 2;
      const std::vector<HttpJob*> jobs =
          under_way < kMostRequests ? queue.take(Clock::now(), allowed) : std::vector<HttpJob*>();
      if (!jobs.empty()) {
        make(jobs, lock);
        continue;
      }
      const auto next = under_way < kMostRequests ? queue.nextReady(allowed) : std::nullopt;
      if (next)
        changed.wait_until(lock, *next);
      else
        changed.wait(lock);
    }
    watch.readEnds();
    if (job.failure) std::rethrow_exception(job.failure);
  }

  void make(const std::vector<HttpJob*>& jobs, std::unique_lock<std::mutex>& lock) {
    const auto asked = Clock::now();
    ++under_way;
    if (jobs.front()->background) ++background;
    ++counted.requests;
    counted.merged += jobs.size() - 1;
    lock.unlock();
    std::vector<std::exception_ptr> failures(jobs.size());
    bool again = false, silent = false;
    double wait_s = 0;
    std::uint64_t bytes = 0;
    try {
      again = !answer(jobs, bytes, wait_s, silent);
    } catch (...) {
      std::fill(failures.begin(), failures.end(), std::current_exception());
    }
    lock.lock();
    --under_way;
    if (jobs.front()->background) --background;
    counted.bytes += bytes;
    silent ? watch.unanswered(Clock::now()) : watch.answered(asked, Clock::now());
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      HttpJob& job = *jobs[i];
      if (again && isTriedAgain(job, wait_s)) {
        ++counted.retries;
        queue.add(job);
        continue;
      }
      if (again)
        failures[i] = std::make_exception_ptr(
            IoError(inShort(job.url), "cannot be read: no answer from the server; check the network"));
      job.failure = failures[i];
      job.done = true;
    }
    changed.notify_all();
  }

  bool isTriedAgain(HttpJob& job, double wait_s) const {
    ++job.attempts;
    const double backoff_s =
        std::max(std::min(kLastBackoff_s, kFirstBackoff_s * std::ldexp(1, job.attempts - 1)), wait_s);
    if (job.attempts >= kMostAttempts || secondsSince(job.begun) + backoff_s > options.deadline_s) return false;
    job.not_before =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(backoff_s));
    return true;
  }

  // Makes one request for all jobs. False: no answer (`silent`), or one that may pass; `wait_s` is then what the server
  // asks for.
  bool answer(const std::vector<HttpJob*>& jobs, std::uint64_t& bytes, double& wait_s, bool& silent) const {
    HttpJob& first = *jobs.front();
    std::uint64_t begin = first.offset, end = first.end();
    for (const HttpJob* const job : jobs) begin = std::min(begin, job->offset), end = std::max(end, job->end());
    const bool is_range = first.kind == HttpJob::Kind::range;
    std::string url = first.url;
    if (is_range) url += "/" + std::to_string(begin) + "-" + std::to_string(end - 1);
    Bytes body(is_range ? end - begin : 0);
    PageRequest request{.url = url.c_str(), .token = options.token.c_str()};
    request.method = first.kind == HttpJob::Kind::size ? PageRequest::Method::head : PageRequest::Method::get;
    request.past_the_cache = first.attempts > 0 ? 1 : 0;
    request.timeout_ms =
        static_cast<std::uint32_t>(1000 * (options.stall_s + static_cast<double>(end - begin) / 65536));
    askFor(request, body);
    const int status = request.status;
    const std::uint64_t got = bytes = request.body_bytes;
    silent = status == 0;
    if (isPassing(status)) {
      wait_s = request.retry_after_s;
      return false;
    }
    if (status == 404 || status == 410)
      throw NotOnServer(inShort(first.url), "is not on the server (" + std::to_string(status) + ")");
    if (status == 401 || status == 403)
      throw IoError(inShort(first.url),
                    "the server refuses access (" + std::to_string(status) + "); open its page again with the token");
    if (status == 416) throw CorruptSet(inShort(first.url), begin, "the file ends before here");
    if (status != 200)
      throw IoError(inShort(first.url),
                    "the server answered " + std::to_string(status) + "; check the address and the server");
    if (first.kind == HttpJob::Kind::size) {
      if (request.stated_bytes < 0)
        throw IoError(inShort(first.url), "the server does not state its size; serve the set with another server");
      first.size = static_cast<std::uint64_t>(request.stated_bytes);
    } else if (first.kind == HttpJob::Kind::whole) {
      if (got > first.most)
        throw IoError(inShort(first.url),
                      "has more than " + std::to_string(first.most) + " bytes, so it belongs to no tile set");
      body.resize(got);
      request.method = PageRequest::Method::kept;
      if (got > 0) askFor(request, body);
      first.whole = std::move(body);
    } else {
      if (got != body.size()) return false;  // cut short
      for (const HttpJob* const job : jobs)
        std::memcpy(job->bytes.data(), body.data() + (job->offset - begin), job->bytes.size());
    }
    return true;
  }
};

HttpClient::HttpClient(std::string origin, const RemoteOptions& options, std::shared_ptr<const S3Account>)
    : impl_(new Impl{.origin = std::move(origin), .options = options}) {}
HttpClient::~HttpClient() = default;

void HttpClient::readRange(const std::string& url, std::uint64_t offset, std::span<std::uint8_t> bytes) {
  if (bytes.empty()) return;
  HttpJob job{.kind = HttpJob::Kind::range, .url = url, .offset = offset, .bytes = bytes};
  impl_->wait(job);
}

Bytes HttpClient::readWhole(const std::string& url, std::uint64_t most) {
  HttpJob job{.kind = HttpJob::Kind::whole, .url = url, .most = most};
  impl_->wait(job);
  return std::move(job.whole);
}

HttpClient::FileFacts HttpClient::facts(const std::string& url) {
  HttpJob job{.kind = HttpJob::Kind::size, .url = url};
  impl_->wait(job);
  return {.bytes = job.size};
}

RemoteCounters HttpClient::counters() const {
  const std::lock_guard lock(impl_->mutex);
  RemoteCounters counters = impl_->counted;
  impl_->watch.describe(counters, Clock::now());
  return counters;
}

}  // namespace filiform::internal
