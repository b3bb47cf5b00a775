#include "tools/serve/sets/picture_maker.h"

#include "tools/pictures/png.h"
#include "tools/serve/sets/served_set.h"
#include "tools/words/refusal.h"
#include "viewer/gl/scene_view.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <list>
#include <mutex>
#include <optional>
#include <sys/resource.h>
#include <thread>
#include <utility>

namespace filiform::tools {

namespace {

using PictureBytes = std::shared_ptr<const std::string>;
using PictureClock = std::chrono::steady_clock;

PictureClock::duration durationOf(double s) {
  return std::chrono::duration_cast<PictureClock::duration>(std::chrono::duration<double>(s));
}

Camera cameraFor(const CameraText& text, const SceneView& scene, double aspect) {
  if (text.kind == CameraText::Kind::places)
    return fitDepth(lookAt(text.eye_W, text.target_W), scene.lo_W(), scene.hi_W());
  return overview(scene.usual_lo_W(), scene.usual_hi_W(), text.yaw_rad, text.pitch_rad, aspect);
}

// What the drawing thread owns.
class Easel {
 public:
  PictureBytes draw(const std::shared_ptr<const ServedSet>& served, const CameraText& camera, PictureSize size,
                    const std::function<void()>& check) {
    if (!renderer_) {
      // Drawing in software takes all cores; what answers and travels comes first. Holds for this thread and its own.
      ::setpriority(PRIO_PROCESS, 0, 10);
      context_ = makeOffscreenContext();
      renderer_.emplace(*context_);
    }
    if (served_ != served) {
      scene_.reset();
      served_ = served;
      scene_ = std::make_unique<SceneView>(served->set(), served->levels(), *renderer_);
    }
    SceneFrame frame;
    frame.size = size;
    frame.budget.segments = PictureMaker::kMostSegments;
    frame.camera = cameraFor(camera, *scene_, size.aspect());
    scene_->drawWhole(frame, [&](std::size_t, std::size_t) { check(); });
    return std::make_shared<const std::string>(pngBytes(renderer_->read()));
  }

 private:
  std::unique_ptr<GraphicsContext> context_;
  std::optional<Renderer> renderer_;
  std::shared_ptr<const ServedSet> served_;
  std::unique_ptr<SceneView> scene_;
};

}  // namespace

struct PictureMaker::Impl {
  struct Order {
    std::string key;
    std::shared_ptr<const ServedSet> served;
    CameraText camera;
    PictureSize size;
    std::promise<PictureBytes> promise;
    std::shared_future<PictureBytes> picture;
  };

  void work() {
    Easel easel;
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [this] { return stopping || !orders.empty(); });
      if (stopping) return;
      Order& order = *orders.front();
      lock.unlock();
      const auto until = PictureClock::now() + durationOf(kMostDrawing_s);
      PictureBytes drawn;
      std::exception_ptr failure;
      try {
        drawn = easel.draw(order.served, order.camera, order.size, [&] {
          if (stopping || PictureClock::now() > until) throw AnswerTimeout();
        });
      } catch (const GraphicsError&) {
        failure = std::make_exception_ptr(Refusal(501, "this server draws no pictures: it has no OpenGL 3.3"));
      } catch (const InputError&) {
        failure = std::make_exception_ptr(Refusal(404, "the set has no segment to draw"));
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      failure ? order.promise.set_exception(failure) : order.promise.set_value(drawn);
      if (drawn) keep(order.key, drawn);
      orders.pop_front();
    }
  }

  void keep(const std::string& key, const PictureBytes& picture) {
    kept.emplace_front(key, picture);
    kept_bytes += picture->size();
    while (kept_bytes > kKeptBytes && kept.size() > 1) {
      kept_bytes -= kept.back().second->size();
      kept.pop_back();
    }
  }

  std::mutex mutex;
  std::condition_variable wake;
  std::atomic<bool> stopping{false};
  std::deque<std::unique_ptr<Order>> orders;             // the first is being drawn
  std::list<std::pair<std::string, PictureBytes>> kept;  // most recent first
  std::size_t kept_bytes = 0;
  std::thread thread;
};

PictureMaker::PictureMaker() : impl_(std::make_unique<Impl>()) {}

PictureMaker::~PictureMaker() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
  }
  impl_->wake.notify_all();
  if (impl_->thread.joinable()) impl_->thread.join();
}

std::shared_ptr<const std::string> PictureMaker::draw(std::shared_ptr<const ServedSet> served,
                                                      const std::string& camera, PictureSize size, double most_s) {
  const CameraText text = parseCamera("camera", camera);
  if (text.kind == CameraText::Kind::follow) throw UsageError("camera follow: the service has no workspace to follow");
  std::string key = served->name() + '\0' + served->set().revision() + '\0' + camera;
  key += '\0' + std::to_string(size.width) + 'x' + std::to_string(size.height);
  const auto until = PictureClock::now() + durationOf(most_s);
  std::shared_future<PictureBytes> picture;
  {
    const std::lock_guard lock(impl_->mutex);
    for (auto at = impl_->kept.begin(); at != impl_->kept.end(); ++at)
      if (at->first == key) {
        impl_->kept.splice(impl_->kept.begin(), impl_->kept, at);
        return at->second;
      }
    for (const auto& order : impl_->orders)
      if (order->key == key) picture = order->picture;
    if (!picture.valid()) {
      if (impl_->orders.size() >= kMostPictures) throw Refusal(503, "too many pictures are being drawn; ask again");
      auto order = std::make_unique<Impl::Order>();
      order->key = std::move(key);
      order->served = std::move(served);
      order->camera = text;
      order->size = size;
      picture = order->picture = order->promise.get_future().share();
      impl_->orders.push_back(std::move(order));
      if (!impl_->thread.joinable()) impl_->thread = std::thread([this] { impl_->work(); });
    }
  }
  impl_->wake.notify_all();
  if (picture.wait_until(until) != std::future_status::ready) throw AnswerTimeout();
  return picture.get();
}

}  // namespace filiform::tools
