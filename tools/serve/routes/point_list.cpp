#include "tools/serve/routes/point_list.h"

#include "index/text.h"
#include "tools/words/refusal.h"

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

// Receives the events of the parser, so that hostile JSON makes no tree.
class PointListEvents final : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit PointListEvents(std::size_t most) : most_(most) {}
  PointList list;
  bool hasPoints() const { return seen_.contains("points"); }

  bool null() override { refuse(); }
  bool boolean(bool) override { refuse(); }
  bool number_integer(number_integer_t value) override { return number(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return number(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return number(value); }
  bool string(string_t&) override { refuse(); }
  bool binary(binary_t&) override { refuse(); }
  bool start_object(std::size_t) override {
    if (depth_ != 0) refuse();
    depth_ = 1;
    return true;
  }
  bool key(string_t& name) override {
    if (name.size() > 32 || !seen_.emplace(name, 0).second) refuse();
    name_ = name;
    return true;
  }
  bool end_object() override { return true; }
  bool start_array(std::size_t) override {
    if (depth_ == 0 || name_ != "points" || depth_ == 3) refuse();
    if (++depth_ == 3) {
      if (list.points.size() == most_)
        throw Refusal(413,
                      "the body has more than " + std::to_string(most_) + " points; send them in several requests");
      list.points.emplace_back(0, 0, 0);
      axis_ = 0;
    }
    return true;
  }
  bool end_array() override {
    if (depth_-- == 3 && axis_ != 3) refuse();
    return true;
  }
  bool parse_error(std::size_t at, const std::string&, const nlohmann::detail::exception&) override {
    throw Refusal(400, "the body is no JSON: an error at byte " + std::to_string(at));
  }

 private:
  [[noreturn]] static void refuse() {
    throw Refusal(400, "the JSON body must be an object such as {\"points\": [[1, 2, 3], [4, 5, 6]], \"k\": 1}");
  }
  bool number(double value) {
    if (depth_ == 1 && name_ != "points") {
      list.numbers[name_] = value;
    } else {
      if (depth_ != 3 || axis_ == 3) refuse();
      list.points.back()[static_cast<Eigen::Index>(axis_++)] = value;
    }
    return true;
  }

  const std::size_t most_;
  std::size_t depth_ = 0, axis_ = 0;  // 1 in the object, 2 in `points`, 3 in a point
  std::string name_;
  std::map<std::string, int> seen_;
};

}  // namespace

PointList readPointList(std::string_view json, std::size_t most) {
  PointListEvents events(most);
  nlohmann::json::sax_parse(json.begin(), json.end(), &events);
  if (!events.hasPoints()) throw Refusal(400, "the JSON body has no points; send {\"points\": [[1, 2, 3], [4, 5, 6]]}");
  return std::move(events.list);
}

}  // namespace filiform::tools
