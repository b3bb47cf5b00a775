#include "index/formats/internal/mouselight.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using JsonNumbers = nlohmann::json;

constexpr std::int64_t kMaxSampleNumber = std::int64_t{1} << 61;

// The bytes of a stream as an input iterator; the one without a stream is the end.
struct StreamBytes {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = char;

  internal::ByteStream* in = nullptr;

  bool atEnd() const { return in == nullptr || in->peek() == internal::ByteStream::kEnd; }
  char operator*() const { return static_cast<char>(in->peek()); }
  StreamBytes& operator++() {
    in->get();
    return *this;
  }
  StreamBytes operator++(int) {
    const StreamBytes before = *this;
    in->get();
    return before;
  }
  bool operator==(const StreamBytes& other) const { return atEnd() == other.atEnd(); }
  bool operator!=(const StreamBytes& other) const { return !(*this == other); }
};

// Receives the events of the JSON parser. A level is the number of objects and arrays around a value.
class NeuronEvents {
 public:
  NeuronEvents(internal::ByteStream& in, internal::GraphBuilder& graph) : in_(in), graph_(graph) {}

  bool null() { return value(std::nullopt); }
  bool boolean(bool) { return value(std::nullopt); }
  bool number_integer(std::int64_t v) { return value(static_cast<double>(v), v); }
  bool number_unsigned(std::uint64_t v) {
    return v <= INT64_MAX ? value(static_cast<double>(v), static_cast<std::int64_t>(v)) : value(static_cast<double>(v));
  }
  bool number_float(double v, const std::string&) { return value(v); }
  bool string(std::string&) { return value(std::nullopt); }
  bool binary(JsonNumbers::binary_t&) { return value(std::nullopt); }

  bool key(std::string& name) {
    if (level_ == 1)
      part_ = name == "axon"       ? Part::kAxon
              : name == "dendrite" ? Part::kDendrite
              : name == "soma"     ? Part::kSoma
                                   : Part::kOther;
    field_ = Field::kOther;
    for (std::size_t i = 0; i < kFields.size(); ++i)
      if (name == kFields[i]) field_ = static_cast<Field>(i);
    return true;
  }
  bool start_object(std::size_t) {
    if (level_ == 0) is_object_ = true;
    ++level_;
    if (holdsFields()) sample_ = {.line = in_.line()};
    return true;
  }
  bool end_object() {
    if (holdsFields()) part_ == Part::kSoma ? keepSoma() : addSample();
    --level_;
    return true;
  }
  bool start_array(std::size_t) {
    if (level_ == 1 && isList()) beginList();
    ++level_;
    return true;
  }
  bool end_array() {
    --level_;
    return true;
  }
  template <class Error>
  bool parse_error(std::size_t byte, const std::string&, const Error&) {
    graph_.refuse(InputCode::E_FORMAT, in_.line(), "invalid JSON, byte " + std::to_string(byte) + " of neuron");
    return false;
  }

  void finish() {
    if (graph_.refused()) return;
    if (!is_object_) return graph_.refuse(InputCode::E_FORMAT, 1, "a neuron must be a JSON object");
    if (!any_sample_ && soma_) graph_.node(1, *soma_, std::nan(""), 1, 1, "soma");
  }

 private:
  enum class Part : std::uint8_t { kOther, kAxon, kDendrite, kSoma };
  enum class Field : std::uint8_t { kNumber, kType, kX, kY, kZ, kRadius, kParent, kOther };
  static constexpr std::array<std::string_view, 7> kFields = {"sampleNumber", "structureIdentifier", "x", "y", "z",
                                                              "radius",       "parentNumber"};
  struct Sample {
    std::uint64_t line = 0;
    struct Value {
      bool given = false;
      std::optional<double> real = {};
      std::optional<std::int64_t> integer = {};
    };
    std::array<Value, kFields.size()> fields = {};
    const Value& operator[](Field field) const { return fields[static_cast<std::size_t>(field)]; }
  };

  bool isList() const { return part_ == Part::kAxon || part_ == Part::kDendrite; }
  // Whether the innermost value is an object of a list, or the soma.
  bool holdsFields() const { return (level_ == 3 && isList()) || (level_ == 2 && part_ == Part::kSoma); }

  bool value(std::optional<double> real, std::optional<std::int64_t> integer = {}) {
    if (!holdsFields() || field_ == Field::kOther) return true;
    if (real && !integer && std::trunc(*real) == *real && std::abs(*real) < 9e15)
      integer = static_cast<std::int64_t>(*real);
    sample_.fields[static_cast<std::size_t>(field_)] = {true, real, integer};
    return true;
  }

  std::optional<Vector3d> position() const {
    Vector3d place;
    for (int axis = 0; axis < 3; ++axis) {
      const auto& field = sample_[static_cast<Field>(static_cast<int>(Field::kX) + axis)];
      if (!field.real) return std::nullopt;
      place[axis] = *field.real;
    }
    return place;
  }

  void keepSoma() {
    if (!soma_) soma_ = position();
  }

  void beginList() {
    offset_ = largest_;
    twin_.reset();
  }

  std::int64_t idOf(std::int64_t number) const { return twin_ && number == *twin_ ? soma_id_ : number + offset_; }

  void addSample() {
    any_sample_ = true;
    const auto& number = sample_[Field::kNumber];
    const std::uint64_t line = sample_.line;
    const std::optional<Vector3d> place = position();
    if (!number.given) return graph_.dropNode(InputCode::W_SHORT_LINE, line, "sampleNumber is missing");
    if (!number.integer || *number.integer < 0 || *number.integer > kMaxSampleNumber || offset_ > kMaxSampleNumber)
      return graph_.dropNode(InputCode::W_BAD_ID, line, "sampleNumber");
    if (!place) return graph_.dropNode(InputCode::W_BAD_LINE, line, "x, y or z is no number");
    const auto& parent = sample_[Field::kParent];
    const bool root = parent.integer && *parent.integer < 0;
    if (root && isTwinOfSoma(*number.integer, *place)) return;
    const std::int64_t id = idOf(*number.integer);
    largest_ = std::max(largest_, id);
    if (root && !soma_place_) {
      soma_place_ = place;
      soma_id_ = id;
    }
    if (!graph_.node(id, *place, radius(line), type(line), line, "sample " + std::to_string(*number.integer))) return;
    if (!parent.integer || *parent.integer > kMaxSampleNumber) {
      graph_.cutLink(InputCode::W_BAD_PARENT, line, "parentNumber");
    } else if (!root) {
      graph_.link(id, idOf(*parent.integer), line);
    } else if (*parent.integer != -1) {
      graph_.remark(InputCode::W_ROOT_CODE, line, std::to_string(*parent.integer));
    }
  }

  // True for the first root of a later list that lies where the soma lies.
  bool isTwinOfSoma(std::int64_t number, const Vector3d& place) {
    if (offset_ == 0 || twin_ || !soma_place_ || place != *soma_place_) return false;
    twin_ = number;
    return true;
  }

  double radius(std::uint64_t line) {
    const auto& field = sample_[Field::kRadius];
    if (!field.given || field.real) return field.given ? *field.real : std::nan("");
    graph_.remark(InputCode::W_BAD_RADIUS, line, "radius");
    return std::nan("");
  }

  std::uint16_t type(std::uint64_t line) {
    const auto& field = sample_[Field::kType];
    if (!field.given) return part_ == Part::kAxon ? 2 : 3;
    if (field.integer && *field.integer >= 0 && *field.integer <= 65535)
      return static_cast<std::uint16_t>(*field.integer);
    graph_.remark(InputCode::W_BAD_TYPE, line, "structureIdentifier");
    return 0;
  }

  internal::ByteStream& in_;
  internal::GraphBuilder& graph_;
  std::uint64_t level_ = 0;
  bool is_object_ = false, any_sample_ = false;
  Part part_ = Part::kOther;
  Field field_ = Field::kOther;
  Sample sample_;
  std::int64_t largest_ = 0, offset_ = 0;  // ids
  std::optional<std::int64_t> twin_;       // number of the soma in this list, if it is a later one
  std::optional<Vector3d> soma_place_;     // of the first root
  std::int64_t soma_id_ = 0;
  std::optional<Vector3d> soma_;  // of the member `soma`
};

}  // namespace

void readMouseLight(internal::ByteStream& in, internal::GraphBuilder& graph) {
  NeuronEvents events(in, graph);
  JsonNumbers::sax_parse(StreamBytes{&in}, StreamBytes{}, &events);
  events.finish();
}

}  // namespace filiform
