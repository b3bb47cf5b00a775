#include "index/ranks/rank_points.h"

#include "index/errors.h"
#include "index/query/curve_order.h"

#include <cstdint>
#include <cstring>
#include <numeric>
#include <utility>

namespace filiform::tools {

namespace {

struct DealtPoint {  // as it is passed between ranks of one build
  std::uint64_t position;
  double x, y, z;
};

struct TextHead {
  std::uint64_t position, bytes;
};

template <typename Value>
void appendBytesOf(Ranks::Bytes& bytes, const Value& value) {
  const auto* const raw = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), raw, raw + sizeof value);
}

template <typename Value>
Value valueAt(std::span<const std::uint8_t> bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.subspan(at, sizeof value).data(), sizeof value);
  return value;
}

std::span<const std::uint8_t> bytesOf(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

PointPart wholePart(std::span<const Vector3d> points) {
  PointPart part{{points.begin(), points.end()}, std::vector<std::size_t>(points.size())};
  std::iota(part.positions.begin(), part.positions.end(), std::size_t{0});
  return part;
}

void RankPoints::compare(const std::string& what, const std::string& mine) {
  const Ranks::Bytes first = ranks_.share(bytesOf(mine)).front();
  const std::string theirs(first.begin(), first.end());
  if (theirs != mine) throw IoError(what, "is " + mine + " here, and " + theirs + " on rank 0; run the command again");
  ranks_.share({});  // another rank has found a difference
}

std::size_t RankPoints::ofFirst(std::size_t mine) {
  Ranks::Bytes bytes;
  appendBytesOf(bytes, std::uint64_t{mine});
  return valueAt<std::uint64_t>(ranks_.share(bytes).front(), 0);
}

PointPart RankPoints::deal(const Grid& grid, std::span<const Vector3d> points) {
  std::vector<Ranks::Bytes> to(ranks_.count());
  if (ranks_.rank() == 0) {
    const std::vector<std::size_t> order = curveOrder(grid, points);
    for (unsigned r = 0; r < ranks_.count(); ++r) {
      const std::size_t begin = order.size() * r / ranks_.count(), end = order.size() * (r + 1) / ranks_.count();
      to[r].reserve((end - begin) * sizeof(DealtPoint));
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3d& p = points[order[i]];
        appendBytesOf(to[r], DealtPoint{order[i], p.x(), p.y(), p.z()});
      }
    }
  }
  const Ranks::Bytes mine = std::move(passAll(ranks_, std::move(to)).front());
  PointPart part;
  for (std::size_t at = 0; at < mine.size(); at += sizeof(DealtPoint)) {
    const auto dealt = valueAt<DealtPoint>(mine, at);
    part.points.emplace_back(dealt.x, dealt.y, dealt.z);
    part.positions.push_back(dealt.position);
  }
  return part;
}

std::vector<std::string> RankPoints::gather(const PointPart& part, const std::vector<std::string>& texts) {
  Ranks::Bytes mine;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    appendBytesOf(mine, TextHead{part.positions[i], texts[i].size()});
    mine.insert(mine.end(), texts[i].begin(), texts[i].end());
  }
  const std::vector<Ranks::Bytes> all = toFirst(ranks_, std::move(mine));
  std::vector<std::string> gathered;
  if (ranks_.rank() != 0) return gathered;
  for (const Ranks::Bytes& bytes : all)
    for (std::size_t at = 0; at < bytes.size();) {
      const auto head = valueAt<TextHead>(bytes, at);
      at += sizeof head;
      if (head.position >= gathered.size()) gathered.resize(head.position + 1);
      const auto text = std::span(bytes).subspan(at, head.bytes);
      gathered[head.position].assign(text.begin(), text.end());
      at += head.bytes;
    }
  return gathered;
}

}  // namespace filiform::tools
