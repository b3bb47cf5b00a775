#include "index/set/internal/landmarks_file.h"

#include "index/file/internal/digest.h"

#include <bit>
#include <cmath>

namespace filiform::internal {
namespace {

constexpr std::string_view kLandmarksMagic = "FILISMPL";
constexpr std::size_t kLandmarksHeaderBytes = 40, kLandmarkBytes = 36;
constexpr std::int64_t kEdge = std::int64_t{1} << (kMortonAxisBits - 1);

}  // namespace

Bytes encodeLandmarks(const Landmarks& landmarks) {
  ByteWriter body, out;
  for (std::size_t i = 0; i < landmarks.points.size(); ++i) {
    body.point(landmarks.points[i]);
    body.u32(landmarks.segments[i].cell);
    body.u32(landmarks.segments[i].segment);
    body.f32(landmarks.t[i]);
  }
  writeMagic(out, kLandmarksMagic);
  out.u32(static_cast<std::uint32_t>(landmarks.points.size()));
  out.f64(landmarks.covering_radius_um);
  out.u64(checksum(body.bytes()));
  out.u64(checksum(out.bytes()));
  out.append(body.bytes());
  return out.take();
}

Landmarks decodeLandmarks(ByteSpan bytes) {
  ByteReader in(bytes);
  checkMagic(in, kLandmarksMagic);
  const std::uint32_t n = in.u32();
  Landmarks landmarks;
  landmarks.covering_radius_um = in.f64();
  const std::uint64_t body_checksum = in.u64(), header_checksum = in.u64();
  if (checksum(bytes.first(kLandmarksHeaderBytes - 8)) != header_checksum)
    throw Damage{0, "the header's checksum is wrong"};
  in.require(in.left() == std::uint64_t{n} * kLandmarkBytes, "the number of points does not fit the file");
  if (checksum(bytes.subspan(kLandmarksHeaderBytes)) != body_checksum)
    throw Damage{kLandmarksHeaderBytes, "the points' checksum is wrong"};
  in.require(std::isfinite(landmarks.covering_radius_um) && landmarks.covering_radius_um >= 0,
             "the covering radius is not a finite number, 0 or more");
  landmarks.points.reserve(n);
  landmarks.segments.reserve(n);
  landmarks.t.reserve(n);
  // Reads whole words: the first jump waits for this.
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint8_t* const at = in.take(kLandmarkBytes).data();
    const auto coordinate = [at](std::size_t axis) { return static_cast<std::int64_t>(loadLittle64(at + 8 * axis)); };
    landmarks.points.emplace_back(coordinate(0), coordinate(1), coordinate(2));
    in.require((landmarks.points.back().array() >= -kEdge).all() && (landmarks.points.back().array() < kEdge).all(),
               "a point lies outside the grid");
    const std::uint64_t id = loadLittle64(at + 24), last = loadLittle64(at + 28);
    landmarks.segments.push_back({static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(id >> 32)});
    landmarks.t.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(last >> 32)));
    in.require(landmarks.t.back() >= 0 && landmarks.t.back() <= 1, "a point lies beyond its segment");
  }
  return landmarks;
}

}  // namespace filiform::internal
