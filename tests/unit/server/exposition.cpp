#include "tests/unit/server/exposition.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

namespace hairnet::server {
namespace {

// The names that the format allows. Names of labels have no colon, and two leading underscores are Prometheus' own.
bool is_name(const std::string& text, bool label) {
  static const std::regex metric("[a-zA-Z_:][a-zA-Z0-9_:]*"), of_label("[a-zA-Z_][a-zA-Z0-9_]*");
  return std::regex_match(text, label ? of_label : metric) && !(label && text.starts_with("__"));
}

// Go's spelling of numbers, as the format demands. strtod alone would also take hexadecimal numbers and leading spaces.
std::optional<double> number(const std::string& text) {
  if (text == "+Inf") return std::numeric_limits<double>::infinity();
  if (text == "-Inf") return -std::numeric_limits<double>::infinity();
  if (text == "NaN") return std::nan("");
  static const std::regex form(R"([+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)");
  if (!std::regex_match(text, form)) return std::nullopt;
  return std::strtod(text.c_str(), nullptr);
}

// Reads labels like {a="b",c="d"} from `at`, and sets `at` to the character behind the closing brace.
bool parse_labels(const std::string& line, std::size_t& at, std::map<std::string, std::string>& labels) {
  ++at;
  while (at < line.size() && line[at] != '}') {
    const std::size_t equals = line.find("=\"", at);
    if (equals == std::string::npos) return false;
    const std::string name = line.substr(at, equals - at);
    std::string value;
    for (at = equals + 2; at < line.size() && line[at] != '"'; ++at) {
      if (line[at] != '\\') {
        value += line[at];
        continue;
      }
      if (++at >= line.size()) return false;
      if (line[at] == 'n')
        value += '\n';
      else if (line[at] == '\\' || line[at] == '"')
        value += line[at];
      else
        return false;
    }
    if (at >= line.size() || !is_name(name, true) || !labels.emplace(name, value).second) return false;
    if (line[++at] == ',')
      ++at;
    else if (line[at] != '}')
      return false;
  }
  return at++ < line.size();
}

// Reads NAME{LABELS} VALUE with exactly one space. The optional time stamp of the format is refused, since our server
// writes none.
bool parse_sample(const std::string& line, Exposition::Sample& sample) {
  std::size_t at = line.find_first_of("{ ");
  if (at == std::string::npos) return false;
  sample.name = line.substr(0, at);
  if (!is_name(sample.name, false)) return false;
  if (line[at] == '{' && !parse_labels(line, at, sample.labels)) return false;
  if (at >= line.size() || line[at] != ' ') return false;
  const std::optional<double> value = number(line.substr(at + 1));
  if (value) sample.value = *value;
  return value.has_value();
}

// Returns what is wrong with the buckets, the count and the sum of a histogram without other labels; empty when all is
// well. `below` is the count of the bucket before, and `bound` is that bucket's bound.
std::string histogram_error(const std::string& name, const Exposition::Family& family) {
  double bound = -std::numeric_limits<double>::infinity(), below = 0, count = -1;
  bool has_sum = false;
  for (const Exposition::Sample& s : family.samples) {
    if (s.name == name + "_bucket") {
      const auto le = s.labels.find("le");
      if (le == s.labels.end()) return "a bucket without its bound";
      const std::optional<double> next = number(le->second);
      if (!next || !(*next > bound)) return "bounds that do not rise";
      if (s.value < below) return "buckets that are not cumulative";
      bound = *next;
      below = s.value;
    } else if (s.name == name + "_count") {
      count = s.value;
    } else if (s.name == name + "_sum") {
      has_sum = true;
    } else {
      return "no part of a histogram: " + s.name;
    }
  }
  if (!std::isinf(bound)) return "no bucket for all";
  if (count != below) return "a count that is not all buckets";
  return has_sum ? "" : "no sum";
}

// Returns what is wrong with a family as a whole; empty when all is well. All its samples must have the same first
// label, or none.
std::string family_error(const std::string& name, const Exposition::Family& family) {
  if (family.samples.empty()) return "no samples";
  if (family.type == "histogram") return histogram_error(name, family);
  std::set<std::string> label_names;
  for (const Exposition::Sample& s : family.samples) {
    if (s.name != name) return "a sample of another name: " + s.name;
    if (family.type == "counter" && !(s.value >= 0 && std::isfinite(s.value))) return "no count";
    label_names.insert(s.labels.empty() ? "" : s.labels.begin()->first);
  }
  return label_names.size() == 1 ? "" : "samples with different labels: a sum would count twice";
}

}  // namespace

double Exposition::value(const std::string& name, const std::string& label, const std::string& label_value) const {
  std::map<std::string, std::string> labels;
  if (!label.empty()) labels[label] = label_value;
  for (const auto& [family_name, family] : families) {
    for (const Sample& sample : family.samples) {
      if (sample.name == name && sample.labels == labels) return sample.value;
    }
  }
  return std::nan("");
}

bool parse_exposition(const std::string& text, Exposition& exposition, std::string& error) {
  const auto refuse = [&error](const std::string& what, const std::string& where) {
    error = what + ": " + where;
    return false;
  };
  if (text.empty() || text.back() != '\n') return refuse("the last line does not end", "");
  static const std::set<std::string> types{"counter", "gauge", "histogram", "summary", "untyped"};
  std::set<std::string> series;
  Exposition::Family* family = nullptr;
  std::string family_name, line;
  for (std::istringstream lines(text); std::getline(lines, line);) {
    if (line.starts_with("# HELP ")) {
      const std::size_t space = line.find(' ', 7);
      if (space == std::string::npos ||
          !exposition.helps.emplace(line.substr(7, space - 7), line.substr(space + 1)).second)
        return refuse("bad help", line);
      continue;
    }
    if (line.starts_with("# TYPE ")) {
      std::istringstream words(line.substr(7));
      std::string type, more;
      if (!(words >> family_name >> type) || words >> more || !is_name(family_name, false) || !types.contains(type))
        return refuse("bad type", line);
      if (exposition.families.contains(family_name)) return refuse("a family twice", line);
      family = &exposition.families[family_name];
      family->type = type;
      continue;
    }
    Exposition::Sample sample;
    if (!family || !parse_sample(line, sample)) return refuse("bad line", line);
    if (!sample.name.starts_with(family_name)) return refuse("not of the family before it", line);
    // A series is the name with its labels: the line without its value.
    if (!series.insert(line.substr(0, line.rfind(' '))).second) return refuse("a series twice", line);
    family->samples.push_back(std::move(sample));
  }
  for (const auto& [name, checked] : exposition.families) {
    if (const std::string wrong = family_error(name, checked); !wrong.empty()) return refuse(wrong, name);
  }
  return true;
}

}  // namespace hairnet::server
