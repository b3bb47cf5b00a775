#include "tools/lab/bench/index/embree_peer.h"

#ifdef FILIFORM_BENCH_EMBREE

#include "index/geometry/closest_point.h"

#include <cmath>
#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <limits>
#include <memory>
#include <string>
#include <utility>

namespace filiform::tools {

namespace {

// The library is loaded when it is raced, so that other commands do not load it.
class Library {
 public:
  Library() : handle_(::dlopen("libembree3.so.3", RTLD_NOW | RTLD_LOCAL)) {
    const bool all =
        find(newDevice, "rtcNewDevice") && find(releaseDevice, "rtcReleaseDevice") && find(newScene, "rtcNewScene") &&
        find(releaseScene, "rtcReleaseScene") && find(setBuildQuality, "rtcSetSceneBuildQuality") &&
        find(setFlags, "rtcSetSceneFlags") && find(commitScene, "rtcCommitScene") &&
        find(newGeometry, "rtcNewGeometry") && find(releaseGeometry, "rtcReleaseGeometry") &&
        find(setPrimitiveCount, "rtcSetGeometryUserPrimitiveCount") && find(setUserData, "rtcSetGeometryUserData") &&
        find(setBounds, "rtcSetGeometryBoundsFunction") && find(setPointQuery, "rtcSetGeometryPointQueryFunction") &&
        find(commitGeometry, "rtcCommitGeometry") && find(attachGeometry, "rtcAttachGeometry") &&
        find(pointQuery, "rtcPointQuery");
    complete_ = all;
  }
  bool complete() const { return complete_; }

  decltype(&rtcNewDevice) newDevice = nullptr;
  decltype(&rtcReleaseDevice) releaseDevice = nullptr;
  decltype(&rtcNewScene) newScene = nullptr;
  decltype(&rtcReleaseScene) releaseScene = nullptr;
  decltype(&rtcSetSceneBuildQuality) setBuildQuality = nullptr;
  decltype(&rtcSetSceneFlags) setFlags = nullptr;
  decltype(&rtcCommitScene) commitScene = nullptr;
  decltype(&rtcNewGeometry) newGeometry = nullptr;
  decltype(&rtcReleaseGeometry) releaseGeometry = nullptr;
  decltype(&rtcSetGeometryUserPrimitiveCount) setPrimitiveCount = nullptr;
  decltype(&rtcSetGeometryUserData) setUserData = nullptr;
  decltype(&rtcSetGeometryBoundsFunction) setBounds = nullptr;
  decltype(&rtcSetGeometryPointQueryFunction) setPointQuery = nullptr;
  decltype(&rtcCommitGeometry) commitGeometry = nullptr;
  decltype(&rtcAttachGeometry) attachGeometry = nullptr;
  decltype(&rtcPointQuery) pointQuery = nullptr;

 private:
  template <typename Function>
  bool find(Function& function, const char* name) {
    function = handle_ != nullptr ? reinterpret_cast<Function>(::dlsym(handle_, name)) : nullptr;
    return function != nullptr;
  }

  void* handle_;  // never closed, because its threads run until the program ends
  bool complete_ = false;
};

const Library& library() {
  static const Library opened;
  return opened;
}

constexpr double kRounding_um = 2e-3;  // rounding of coordinates below 1e4 um in float, and of results

struct Search {
  const std::vector<SegmentEnds>* segments;
  Vector3d h_W;
  double squared = std::numeric_limits<double>::infinity();
};

void bound(const RTCBoundsFunctionArguments* args) {
  const auto& [a, b] = (*static_cast<const std::vector<SegmentEnds>*>(args->geometryUserPtr))[args->primID];
  const Vector3d lo = a.cwiseMin(b), hi = a.cwiseMax(b);
  const auto down = [](double v) { return std::nextafter(static_cast<float>(v), -INFINITY); };
  const auto up = [](double v) { return std::nextafter(static_cast<float>(v), INFINITY); };
  *args->bounds_o = {down(lo.x()), down(lo.y()), down(lo.z()), 0, up(hi.x()), up(hi.y()), up(hi.z()), 0};
}

bool visit(RTCPointQueryFunctionArguments* args) {
  Search& search = *static_cast<Search*>(args->userPtr);
  const auto& [a, b] = (*search.segments)[args->primID];
  const double squared = closestPoint(a, b, search.h_W).squared_distance;
  if (squared >= search.squared) return false;
  search.squared = squared;
  args->query->radius = static_cast<float>(std::sqrt(squared) + kRounding_um);
  return true;
}

struct Scene {
  RTCDevice device = library().newDevice(nullptr);
  RTCScene scene = library().newScene(device);
  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    library().releaseScene(scene);
    library().releaseDevice(device);
  }
};

PeerSetting embreeSetting(const std::string& name, RTCBuildQuality quality, RTCSceneFlags flags) {
  return {name, true, [quality, flags](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            const auto scene = std::make_shared<Scene>();
            const RTCGeometry geometry = library().newGeometry(scene->device, RTC_GEOMETRY_TYPE_USER);
            library().setPrimitiveCount(geometry, static_cast<unsigned>(segments.size()));
            library().setUserData(geometry, const_cast<std::vector<SegmentEnds>*>(&segments));
            library().setBounds(geometry, bound, nullptr);
            library().setPointQuery(geometry, visit);
            library().commitGeometry(geometry);
            library().attachGeometry(scene->scene, geometry);
            library().releaseGeometry(geometry);
            library().setBuildQuality(scene->scene, quality);
            library().setFlags(scene->scene, flags);
            library().commitScene(scene->scene);
            return [scene, &segments](const Vector3d& h_W) {
              Search search{&segments, h_W};
              RTCPointQuery query{};
              query.x = static_cast<float>(h_W.x()), query.y = static_cast<float>(h_W.y());
              query.z = static_cast<float>(h_W.z()), query.time = 0, query.radius = INFINITY;
              RTCPointQueryContext context;
              rtcInitPointQueryContext(&context);
              library().pointQuery(scene->scene, &query, &context, nullptr, &search);
              return search.squared;
            };
          }};
}

}  // namespace

Peer embreePeer() {
  if (!library().complete()) return {"Embree", "", {}};
  Peer peer{"Embree", RTC_VERSION_STRING, {}};
  for (const auto& [quality, text] :
       {std::pair(RTC_BUILD_QUALITY_LOW, "low quality"), std::pair(RTC_BUILD_QUALITY_MEDIUM, "medium quality"),
        std::pair(RTC_BUILD_QUALITY_HIGH, "high quality")})
    for (const auto& [flags, flag] :
         {std::pair(RTC_SCENE_FLAG_NONE, ""), std::pair(RTC_SCENE_FLAG_COMPACT, ", compact"),
          std::pair(RTC_SCENE_FLAG_ROBUST, ", robust")})
      peer.settings.push_back(embreeSetting(std::string(text) + flag, quality, flags));
  return racedWith(std::move(peer), "high quality");
}

}  // namespace filiform::tools

#else

namespace filiform::tools {

Peer embreePeer() { return {"Embree", "", {}}; }

}  // namespace filiform::tools

#endif
