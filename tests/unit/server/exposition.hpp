#pragma once

#include <map>
#include <string>
#include <vector>

namespace hairnet::server {

// The metrics of a text in Prometheus' text format 0.0.4.
struct Exposition {
  struct Sample {
    std::string name;
    std::map<std::string, std::string> labels;
    double value = 0;
  };
  struct Family {
    std::string type;
    std::vector<Sample> samples;
  };
  std::map<std::string, Family> families;
  // The help texts, by family.
  std::map<std::string, std::string> helps;

  // The value of a sample without labels, or with only this one; NaN when there is none.
  [[nodiscard]] double value(const std::string& name, const std::string& label = "",
                             const std::string& label_value = "") const;
};

// Every line must be a comment of TYPE or HELP, or a sample of the family whose TYPE came last; no series twice; names
// and labels as the format allows; counters finite and not negative; of each histogram cumulative buckets, rising
// bounds up to +Inf, and a count equal to that. Otherwise returns false, and `error` says what and where.
bool parse_exposition(const std::string& text, Exposition& exposition, std::string& error);

}  // namespace hairnet::server
