#include <fmt/format.h>

#include <cmath>

#include "tests/load/fleet_plan/report.hpp"

namespace hairnet::fleet_plan {

std::string number_text(double value) {
  if (std::abs(value) >= 100 || value == std::round(value)) return fmt::format("{:.0f}", value);
  return fmt::format("{:.3g}", value);
}

std::string to_sentence(const Settings& s, const Outcome& o) {
  return fmt::format(
      "{:.0f} people at once in {} rooms take {:.0f} servers of {:g} cores, {:.3g} Gbit/s from them, and {} requests a "
      "second "
      "of etcd at the most.",
      o.people_max, s.rooms, o.servers_max, s.cores, o.egress_bytes_per_s_max * 8 / 1e9, o.etcd_writes_max);
}

std::string to_text(const Settings& settings, const Outcome& outcome) {
  std::string text = to_sentence(settings, outcome) + "\n";
  for (const FigureGroup& group : figures(outcome)) {
    text += "\n" + group.title + "\n";
    for (const Figure& figure : group.figures)
      text += fmt::format("  {:<62} {:>9}{}{}\n", figure.meaning, number_text(figure.value),
                          figure.unit.empty() ? "" : " ", figure.unit);
  }
  return text;
}

}  // namespace hairnet::fleet_plan
