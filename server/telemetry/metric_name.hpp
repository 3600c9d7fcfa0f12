#pragma once

#include <string>
#include <string_view>

namespace hairnet::server {

// The name of a counter, gauge or histogram. In /metrics it is hairnet_FAMILY, or hairnet_FAMILY{LABEL="VALUE"}; a
// counter's ends in _total.
struct MetricName {
  // An empty label and value: the family has no label. The views are of string literals, which live as long as the
  // program.
  std::string_view family, label = {}, value = {};
  // One sentence about the family, with its unit; one member of a family with labels has it.
  std::string_view help = {};
  // The shown value is ours times this, since Prometheus wants seconds and we count nanoseconds.
  double scale = 1;

  // A label and its value come together, a family without a label has its help, and the scale is positive.
  [[nodiscard]] bool is_valid() const {
    return !family.empty() && label.empty() == value.empty() && !(label.empty() && help.empty()) && scale > 0;
  }
  // FAMILY or FAMILY_VALUE, for the log and for standard output.
  [[nodiscard]] std::string flat() const {
    std::string text(family);
    return value.empty() ? text : text.append("_").append(value);
  }
};

}  // namespace hairnet::server
