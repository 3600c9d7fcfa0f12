#include "server/app/config_file.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "core/closest_name.hpp"
#include "server/files/files.hpp"

namespace hairnet::server {
namespace {

// A longer file is refused: the path is wrong.
constexpr std::size_t kConfigFileBytesMax = std::size_t{1} << 20;

std::optional<Setting::Triple> triple_of(const toml::array& array) {
  Setting::Triple triple{};
  if (array.size() != triple.size()) return std::nullopt;
  for (std::size_t i = 0; i < triple.size(); ++i) {
    // TOML tells 1 from 1.0; a person who writes three numbers means the same by both.
    if (!array[i].is_number()) return std::nullopt;
    triple[i] = *array[i].value<double>();
  }
  return triple;
}

// None for values that no setting has: dates, tables, other arrays.
std::optional<Setting::Value> value_of(const toml::node& node) {
  if (const auto* b = node.as_boolean()) return Setting::Value(b->get());
  if (const auto* i = node.as_integer()) return Setting::Value(i->get());
  if (const auto* f = node.as_floating_point()) return Setting::Value(f->get());
  if (const auto* s = node.as_string()) return Setting::Value(s->get());
  if (const auto* a = node.as_array()) {
    if (const auto triple = triple_of(*a)) return Setting::Value(*triple);
  }
  return std::nullopt;
}

// Reads one file into the settings. Each function returns the first error, as a line.
class Reader {
 public:
  Reader(const std::string& path, const std::vector<Setting>& settings) : path_(&path), settings_(&settings) {}

  Result<std::set<std::string>> read(const toml::table& file) {
    for (const auto& [section, node] : file) {
      const std::string_view name = section.str();
      // A name that nobody reads must not be ignored: its author believes that it is set.
      if (std::none_of(settings_->begin(), settings_->end(), [&](const Setting& s) { return s.section == name; }))
        return error(node, fmt::format("there is no {} '{}'", node.is_table() ? "section" : "key", name));
      if (!node.is_table()) return error(node, fmt::format("'{}' is a section, not a key", name));
      if (std::string wrong = read_section(name, *node.as_table()); !wrong.empty()) return Refusal(std::move(wrong));
    }
    return std::move(names_);
  }

 private:
  // Values are set one by one, so an error in the middle leaves the earlier ones set; the caller then ends the program.
  std::string read_section(std::string_view section, const toml::table& table) {
    for (const auto& [key, node] : table) {
      const std::string name = fmt::format("{}.{}", section, key.str());
      const auto setting =
          std::find_if(settings_->begin(), settings_->end(), [&](const Setting& s) { return s.name() == name; });
      if (setting == settings_->end())
        return place(node, fmt::format("there is no key '{}'{}", name, nearest_to(name)));
      std::optional<Setting::Value> value = value_of(node);
      if (!value) return place(node, name + ": is of a type that no setting takes");
      if (const std::string wrong = check(*setting, *value); !wrong.empty())
        return place(node, fmt::format("{}: {}", name, wrong));
      setting->set(*value);
      names_.insert(name);
    }
    return {};
  }
  // A hint with the key that the wrong one is most like; empty when none is near.
  [[nodiscard]] std::string nearest_to(const std::string& name) const {
    std::vector<std::string> names;
    for (const Setting& setting : *settings_) names.push_back(setting.name());
    const std::string_view nearest = closest_name(name, names);
    return nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest);
  }
  Refusal error(const toml::node& node, const std::string& what) const { return Refusal(place(node, what)); }
  // Editors jump to a place that is written as file:line.
  std::string place(const toml::node& node, const std::string& what) const {
    return fmt::format("{}:{}: {}", *path_, node.source().begin.line, what);
  }

  const std::string* path_;
  const std::vector<Setting>* settings_;
  std::set<std::string> names_;
};

}  // namespace

Result<std::set<std::string>> read_config_file(const std::string& path, const std::vector<Setting>& settings) {
  const Result<std::string> text = read_text_file(path, kConfigFileBytesMax);
  if (!text) return Refusal(path + ": " + text.error());
  try {
    return Reader(path, settings).read(toml::parse(*text));
  } catch (const toml::parse_error& error) {
    return Refusal(fmt::format("{}:{}: {}", path, error.source().begin.line, error.description()));
  }
}

std::string config_file_text(const std::vector<Setting>& settings) {
  std::string text;
  std::string_view section;
  for (const Setting& s : settings) {
    if (s.section != section) {
      text += fmt::format("{}[{}]\n", section.empty() ? "" : "\n", s.section);
      section = s.section;
    }
    text += fmt::format("{} = {}\n", s.key, to_toml(s.get()));
  }
  return text;
}

}  // namespace hairnet::server
