#include "index/remote/internal/http_client.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/remote/internal/answer_watch.h"
#include "index/remote/internal/background_reads.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/http_flight.h"
#include "index/remote/internal/http_queue.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <curl/curl.h>
#include <mutex>
#include <thread>
#include <utility>

namespace filiform::internal {
namespace {

constexpr int kMostAttempts = 6, kMostRedirects = 5;
constexpr std::uint64_t kMostReply = 1 << 20;
constexpr double kFirstBackoff_s = 0.1, kLastBackoff_s = 2;
// How often the thread looks at the flag of an interruption.
constexpr std::chrono::milliseconds kWatch{100};
// The background uses a sixteenth of the connections until no other read came for this time, then half of them. The
// fewer it uses, the more of its ranges wait, and go together in one request.
constexpr std::chrono::milliseconds kBesideOthers{1000};
// From far away a range waits for neighbours that come at the same time, such as the tiles of one plan: this part of
// the fastest answer, at most kMostGather_s. An answer within kNear_s comes from near.
constexpr double kGatherPart = 0.1, kMostGather_s = 0.002, kNear_s = 0.005;

using FlightClock = HttpJob::Clock;

double secondsSince(FlightClock::time_point t) { return std::chrono::duration<double>(FlightClock::now() - t).count(); }

FlightClock::duration inSeconds(double s) {
  return std::chrono::duration_cast<FlightClock::duration>(std::chrono::duration<double>(s));
}

std::exception_ptr errorOf(const HttpJob& job, const HttpLanding& landing) {
  const std::string url = inShort(job.url);
  if (landing.kind == HttpLanding::Kind::missing)
    return std::make_exception_ptr(
        NotOnServer(url, landing.what + "; check the address. If the set was replaced meanwhile, open it again"));
  if (landing.kind == HttpLanding::Kind::ends)
    return std::make_exception_ptr(CorruptSet(url, landing.file_bytes, "the file ends here"));
  std::string what = landing.what;
  if (job.attempts > 1)
    what += ", " + counted(job.attempts, "time") + " in " +
            std::to_string(static_cast<int>(std::ceil(secondsSince(job.begun)))) + " s";
  if (landing.kind == HttpLanding::Kind::denied)
    return std::make_exception_ptr(DeniedByServer(url, what + "; " + landing.remedy));
  return std::make_exception_ptr(IoError(url, what + "; " + landing.remedy));
}

void checkRemoteOptions(const RemoteOptions& options) {
  if (options.connections < 1 || options.connections > 64) throw UsageError("connections: give 1 to 64");
  if (!(options.deadline_s > 0 && options.deadline_s <= 1e6)) throw UsageError("deadline: give more than 0 s");
  if (!std::all_of(options.token.begin(), options.token.end(), [](char c) { return c > ' ' && c < '\x7f'; }))
    throw UsageError("the token contains a blank or a character that is not ASCII; check --token-file");
}

}  // namespace

struct HttpClient::Impl {
  const std::string origin;
  const RemoteOptions options;
  const std::shared_ptr<const S3Account> account;
  CURLM* const multi;
  mutable std::mutex mutex;
  std::condition_variable answered;
  HttpQueue queue;    // guarded by the mutex
  AnswerWatch watch;  // guarded by the mutex
  bool stopping = false;
  std::vector<std::unique_ptr<HttpFlight>> free, active;  // of the thread
  double fastest_s = 0;                                   // from a request to its answer; 0: not known
  FlightClock::time_point last_other{};                   // when a read that is not of the background last began
  std::atomic<std::uint64_t> requests{0}, retries{0}, merged{0}, bytes{0};
  std::thread thread;

  Impl(std::string o, const RemoteOptions& given, std::shared_ptr<const S3Account> keys)
      : origin(std::move(o)), options(given), account(std::move(keys)), multi(curl_multi_init()) {
    if (multi == nullptr) throw std::bad_alloc();
    curl_multi_setopt(multi, CURLMOPT_MAX_HOST_CONNECTIONS, static_cast<long>(options.connections));
    curl_multi_setopt(multi, CURLMOPT_MAXCONNECTS, static_cast<long>(options.connections));
    thread = std::thread([this] { run(); });
  }
  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    curl_multi_wakeup(multi);
    thread.join();
    for (const auto& flight : active) curl_multi_remove_handle(multi, flight->handle());
    active.clear();
    free.clear();
    curl_multi_cleanup(multi);
  }

  void wait(HttpJob& job) {
    job.begun = FlightClock::now();
    job.background = BackgroundReads::active();
    std::unique_lock lock(mutex);
    if (!job.background) last_other = job.begun;
    if (job.kind == HttpJob::Kind::range && fastest_s > kNear_s) {
      job.gathering = true;
      job.not_before = job.begun + inSeconds(std::min(kMostGather_s, kGatherPart * fastest_s));
    }
    queue.add(job);
    watch.readBegins(job.begun);
    curl_multi_wakeup(multi);
    answered.wait(lock, [&] { return job.done; });
    watch.readEnds();
    if (job.failure) std::rethrow_exception(job.failure);
  }

  bool cancelled() const { return options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed); }

  void run() {
    while (true) {
      int timeout_ms = 0;
      {
        const std::lock_guard lock(mutex);
        if (stopping) return;
        if (cancelled()) cancelQueue();
        startQueue();
        timeout_ms = patience();
      }
      if (cancelled()) cancelActive();
      int running = 0;
      curl_multi_perform(multi, &running);
      int left = 0;
      bool landed = false;
      while (CURLMsg* const message = curl_multi_info_read(multi, &left)) {
        landed = true;
        land(message->easy_handle, message->data.result);
      }
      if (!landed) curl_multi_poll(multi, nullptr, 0, timeout_ms, nullptr);
    }
  }

  // How long the thread may sleep, ms.
  int patience() const {
    const auto next = queue.nextReady(mayStartBackground());
    if (active.empty() && !next) return 3'600'000;
    FlightClock::duration wait = kWatch;
    if (next && active.size() < options.connections) wait = std::min(wait, *next - FlightClock::now());
    return static_cast<int>(std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::milliseconds>(wait).count()));
  }

  // The caller holds the mutex.
  bool mayStartBackground() const {
    const auto under_way = std::count_if(active.begin(), active.end(),
                                         [](const auto& flight) { return flight->jobs().front()->background; });
    const bool beside = FlightClock::now() - last_other < kBesideOthers;
    return under_way < std::max<std::ptrdiff_t>(1, options.connections / (beside ? 16 : 2));
  }

  void startQueue() {
    while (active.size() < options.connections) {
      std::vector<HttpJob*> jobs = queue.take(FlightClock::now(), mayStartBackground());
      if (jobs.empty()) return;
      merged += jobs.size() - 1;
      try {
        if (free.empty()) free.push_back(std::make_unique<HttpFlight>());
        std::unique_ptr<HttpFlight> flight = std::move(free.back());
        free.pop_back();
        flight->redirects = 0;
        const std::string url = jobs.front()->url;
        prepare(*flight, jobs, url);
        active.push_back(std::move(flight));
      } catch (...) {
        for (HttpJob* const job : jobs) settle(*job, std::current_exception());
      }
    }
  }

  void prepare(HttpFlight& flight, const std::vector<HttpJob*>& jobs, const std::string& url) {
    const bool ours = originOf(url) == origin;
    flight.prepare(jobs, url,
                   {.token = ours ? options.token : std::string(),
                    .account = ours ? account.get() : nullptr,
                    .stall_s = options.stall_s,
                    .deadline_s = options.deadline_s});
    if (curl_multi_add_handle(multi, flight.handle()) != CURLM_OK) throw std::bad_alloc();
    ++requests;
  }

  // The caller holds the mutex.
  void settle(HttpJob& job, std::exception_ptr failure) {
    job.failure = std::move(failure);
    job.done = true;
    answered.notify_all();
  }

  void land(CURL* easy, CURLcode code) {
    curl_multi_remove_handle(multi, easy);
    const auto at = std::find_if(active.begin(), active.end(), [&](const auto& f) { return f->handle() == easy; });
    std::unique_ptr<HttpFlight> flight = std::move(*at);
    active.erase(at);
    bytes += flight->received();
    const std::vector<HttpJob*> jobs = flight->jobs();
    curl_off_t sent_us = 0, answered_us = 0, took_us = 0;
    curl_easy_getinfo(easy, CURLINFO_PRETRANSFER_TIME_T, &sent_us);
    curl_easy_getinfo(easy, CURLINFO_STARTTRANSFER_TIME_T, &answered_us);
    curl_easy_getinfo(easy, CURLINFO_TOTAL_TIME_T, &took_us);
    const std::lock_guard lock(mutex);
    const auto now = FlightClock::now();
    code == CURLE_OK ? watch.answered(now - std::chrono::microseconds(took_us), now) : watch.unanswered(now);
    if (answered_us > sent_us) {
      const double took_s = 1e-6 * static_cast<double>(answered_us - sent_us);
      fastest_s = fastest_s > 0 ? std::min(1.01 * fastest_s, took_s) : took_s;  // forgets slowly
      queue.setLatency(fastest_s);
    }
    try {
      HttpLanding landing = flight->land(code);
      if (landing.kind == HttpLanding::Kind::redirect && follow(flight, landing)) return;
      for (HttpJob* const job : jobs) conclude(*job, landing, jobs.size() > 1);
    } catch (...) {
      for (HttpJob* const job : jobs)
        if (!job->done) settle(*job, std::current_exception());
    }
    if (flight) free.push_back(std::move(flight));
  }

  // Sends the request to the target of a redirect. Returns false, with the landing changed, if it must not.
  bool follow(std::unique_ptr<HttpFlight>& flight, HttpLanding& landing) {
    const std::string target = landing.target, to = originOf(target);
    if (++flight->redirects > kMostRedirects || to.empty() ||
        (origin.starts_with("https:") && to.starts_with("http:"))) {
      landing = {.kind = HttpLanding::Kind::refused,
                 .what = to.empty()                           ? "the server redirects to an address that is not HTTP"
                         : flight->redirects > kMostRedirects ? "the server redirects too often"
                                                              : "the server redirects from https to http",
                 .remedy = "check the address and the server"};
      return false;
    }
    const std::vector<HttpJob*> jobs = flight->jobs();
    prepare(*flight, jobs, target);
    active.push_back(std::move(flight));
    return true;
  }

  void conclude(HttpJob& job, const HttpLanding& landing, bool was_merged) {
    if (landing.kind == HttpLanding::Kind::done) return settle(job, nullptr);
    if (was_merged) {  // the fault may be that of another range
      job.alone = true;
      queue.add(job);
      ++retries;
      return;
    }
    ++job.attempts;
    job.gathering = false;
    const double backoff_s = std::min(kLastBackoff_s, kFirstBackoff_s * std::ldexp(1, job.attempts - 1));
    const double wait_s = std::max(backoff_s, landing.wait_s);
    if (landing.kind != HttpLanding::Kind::retry || job.attempts >= kMostAttempts ||
        secondsSince(job.begun) + wait_s > options.deadline_s)
      return settle(job, errorOf(job, landing));
    job.not_before = FlightClock::now() + inSeconds(wait_s);
    queue.add(job);
    ++retries;
  }

  static std::exception_ptr interruption() { return std::make_exception_ptr(Interrupted("interrupted")); }
  void cancelQueue() {
    for (HttpJob* const job : queue.takeAll()) settle(*job, interruption());
  }
  void cancelActive() {
    const std::lock_guard lock(mutex);
    for (std::unique_ptr<HttpFlight>& flight : active) {
      curl_multi_remove_handle(multi, flight->handle());
      for (HttpJob* const job : flight->jobs()) settle(*job, interruption());
      free.push_back(std::move(flight));
    }
    active.clear();
  }
};

HttpClient::HttpClient(std::string origin, const RemoteOptions& options, std::shared_ptr<const S3Account> account) {
  checkRemoteOptions(options);
  // Once a process; libcurl requires it before the first thread that uses it.
  static const CURLcode kStarted = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (kStarted != CURLE_OK) throw IoError(origin, "libcurl cannot be started");
  impl_ = std::make_unique<Impl>(std::move(origin), options, std::move(account));
}

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
  return {job.size, std::move(job.digest)};
}

HttpClient::Reply HttpClient::send(const Request& request) {
  HttpJob job{.kind = HttpJob::Kind::send, .url = request.url, .most = kMostReply};
  job.method = request.method;
  job.body = request.body;
  job.headers = request.headers;
  impl_->wait(job);
  return {std::string(job.whole.begin(), job.whole.end()), std::move(job.tag)};
}

RemoteCounters HttpClient::counters() const {
  RemoteCounters counters{
      .requests = impl_->requests, .retries = impl_->retries, .merged = impl_->merged, .bytes = impl_->bytes};
  const std::lock_guard lock(impl_->mutex);
  impl_->watch.describe(counters, FlightClock::now());
  return counters;
}

}  // namespace filiform::internal
