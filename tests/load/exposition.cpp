#include "tests/load/exposition.hpp"

#include <charconv>

namespace hairnet::load {
namespace {

// "name" of `name{labels}`, and where the labels begin.
std::string_view base_of(std::string_view sample) {
  return sample.substr(0, sample.find('{'));
}

bool grows(std::string_view sample) {
  const std::string_view base = base_of(sample);
  return base.ends_with("_total") || base.ends_with("_sum") || base.ends_with("_count") || base.ends_with("_bucket");
}

}  // namespace

Exposition parse_exposition(std::string_view text) {
  Exposition samples;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    // A label's value may contain spaces: the value follows the closing brace, or the name.
    const std::size_t brace = line.rfind('}');
    const std::size_t space = line.find(' ', brace == std::string_view::npos ? 0 : brace);
    if (space == std::string_view::npos) continue;
    double value = 0;
    const std::string_view number = line.substr(space + 1);
    const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error == std::errc()) samples[std::string(line.substr(0, space))] = value;
  }
  return samples;
}

Exposition exposition_between(const Exposition& from, const Exposition& to) {
  Exposition grown;
  for (const auto& [sample, value] : to) {
    const auto before = from.find(sample);
    grown[sample] = grows(sample) && before != from.end() && before->second <= value ? value - before->second : value;
  }
  Exposition means;
  for (const auto& [sample, sum] : grown) {
    const std::string_view base = base_of(sample);
    if (!base.ends_with("_sum")) continue;
    const std::string stem(base.substr(0, base.size() - 4));
    const std::string labels = sample.substr(base.size());
    const auto count = grown.find(stem + "_count" + labels);
    if (count != grown.end() && count->second > 0) means[stem + "_mean" + labels] = sum / count->second;
  }
  grown.merge(means);
  return grown;
}

std::string_view http_body(std::string_view answer) {
  if (!answer.starts_with("HTTP/1.1 200") && !answer.starts_with("HTTP/1.0 200")) return {};
  const std::size_t end = answer.find("\r\n\r\n");
  return end == std::string_view::npos ? std::string_view() : answer.substr(end + 4);
}

}  // namespace hairnet::load
