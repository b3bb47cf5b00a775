// Conditions on attributes of cells, as `--where` of the commands states them.
//
//   const AttributeConditions conditions({"mtype=L5_*", "layer>=4"});
//   std::cout << conditions.all().front().meets(AttributeValue("L5_TPC:A")) << '\n';
#pragma once

#include "index/cell/attribute.h"
#include "index/errors.h"

#include <string>
#include <vector>

namespace filiform {

// Thread rule: immutable once made.
class AttributeConditions {
 public:
  // Each condition is NAME OP VALUE, with OP one of = == != < <= > >=; == means =. Blanks around NAME and VALUE do not
  // count. A cell must meet all conditions. A missing value meets none, except that NAME!=VALUE holds for it. With =
  // and
  // !=, VALUE may have wildcards: * stands for any text, ? for any character, [ab] for a or b, \ before a character for
  // this character. NAME= selects the cells without a value. < and > need a column of numbers. Throws UsageError for a
  // condition of another form.
  explicit AttributeConditions(const std::vector<std::string>& texts);

  struct Condition {
    std::string name, op, value, whole;
    bool ofOrder() const { return op.starts_with('<') || op.starts_with('>'); }
    // Of text, ofOrder() holds for none. O(pattern * text).
    bool meets(const AttributeValue& value) const;
    // Throws UsageError: the attribute has texts, and the condition is ofOrder().
    [[noreturn]] void refuseText() const;
    // Throws UsageError: there is no such attribute; `what` says which there are.
    [[noreturn]] void refuseName(const std::string& what) const;
  };
  const std::vector<Condition>& all() const { return all_; }
  bool empty() const { return all_.empty(); }

 private:
  std::vector<Condition> all_;
};

}  // namespace filiform
