#include "tools/bench/embree_peer.h"

#ifdef FILIFORM_BENCH_EMBREE

#include "index/closest_point.h"

#include <cmath>
#include <embree3/rtcore.h>
#include <limits>
#include <memory>

namespace filiform::tools {

namespace {

constexpr double kRounding_um = 2e-3;  // of coordinates below 1e4 um in float, and of what is computed with them

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
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

}  // namespace

EmbreePeer embreePeer(const std::vector<SegmentEnds>& segments) {
  const auto scene = std::make_shared<Scene>();
  const RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(segments.size()));
  rtcSetGeometryUserData(geometry, const_cast<std::vector<SegmentEnds>*>(&segments));
  rtcSetGeometryBoundsFunction(geometry, bound, nullptr);
  rtcSetGeometryPointQueryFunction(geometry, visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneBuildQuality(scene->scene, RTC_BUILD_QUALITY_HIGH);
  rtcCommitScene(scene->scene);
  return {RTC_VERSION_STRING, [scene, &segments](const Vector3d& h_W) {
            Search search{&segments, h_W};
            RTCPointQuery query{};
            query.x = static_cast<float>(h_W.x()), query.y = static_cast<float>(h_W.y());
            query.z = static_cast<float>(h_W.z()), query.time = 0, query.radius = INFINITY;
            RTCPointQueryContext context;
            rtcInitPointQueryContext(&context);
            rtcPointQuery(scene->scene, &query, &context, nullptr, &search);
            return search.squared;
          }};
}

}  // namespace filiform::tools

#else

namespace filiform::tools {

EmbreePeer embreePeer(const std::vector<SegmentEnds>&) { return {}; }

}  // namespace filiform::tools

#endif
