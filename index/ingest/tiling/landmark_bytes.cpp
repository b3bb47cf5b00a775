// The bytes in which ranks pass on what they found for landmarks.
#include "index/file/internal/bytes.h"
#include "index/ingest/tiling/landmarks.h"

namespace filiform {

using internal::ByteReader;
using internal::ByteWriter;

std::vector<std::uint8_t> LandmarkSurvey::encode() const {
  ByteWriter out;
  for (const std::uint64_t count : longer_) out.u64(count);
  for (const std::uint64_t count : differ_) out.u64(count);
  out.u64(keys_);
  out.key(first_);
  out.key(last_);
  return out.take();
}

LandmarkSurvey LandmarkSurvey::decode(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  LandmarkSurvey survey;
  for (std::uint64_t& count : survey.longer_) count = in.u64();
  for (std::uint64_t& count : survey.differ_) count = in.u64();
  survey.keys_ = in.u64();
  survey.first_ = in.key();
  survey.last_ = in.key();
  return survey;
}

std::vector<std::uint8_t> LandmarkChooser::Part::encode() const {
  ByteWriter out;
  out.u64(groups_.size());
  for (const Group& group : groups_) {
    out.key(group.block);
    out.point(group.point);
    out.f64(group.distance2);
    out.u32(group.id.cell);
    out.u32(group.id.segment);
    out.box(group.ends);
    out.f64(group.radius2);
  }
  out.u64(pieces_.size());
  for (const Piece& piece : pieces_) {
    out.point(piece.point);
    out.u32(piece.id.cell);
    out.u32(piece.id.segment);
    out.f32(piece.t);
  }
  out.f64(piece_radius_);
  return out.take();
}

LandmarkChooser::Part LandmarkChooser::Part::decode(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  Part part;
  part.groups_.resize(in.u64());
  for (Group& group : part.groups_) {
    group.block = in.key();
    group.point = in.point();
    group.distance2 = in.f64();
    group.id.cell = in.u32();
    group.id.segment = in.u32();
    group.ends = in.box();
    group.radius2 = in.f64();
  }
  part.pieces_.resize(in.u64());
  for (Piece& piece : part.pieces_) {
    piece.point = in.point();
    piece.id.cell = in.u32();
    piece.id.segment = in.u32();
    piece.t = in.f32();
  }
  part.piece_radius_ = in.f64();
  return part;
}

}  // namespace filiform
