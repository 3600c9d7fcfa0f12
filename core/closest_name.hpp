#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hairnet {

// How many letters must be inserted, removed, replaced or swapped with their neighbour to turn one word into the other
// (the distance of optimal string alignment).
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

// The known name that a person who typed `name` probably meant; empty when none is close. Names longer than 64 bytes
// are close to none.
inline std::string_view closest_name(std::string_view name, std::span<const std::string> known) {
  if (name.size() > 64) return {};
  std::string_view closest;
  // A long word may have more wrong letters. A distance as great as the candidate's own length would make every short
  // name close.
  std::size_t least = 2 + name.size() / 4;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance >= least || distance >= candidate.size()) continue;
    least = distance;
    closest = candidate;
  }
  return closest;
}

// One line about words of a command line that a program does not know, in the order in which they were typed: about the
// first flag, or else the first word. `flags` are without their dashes.
inline std::string unexpected_argument(std::span<const std::string> unknown, std::span<const std::string> flags,
                                       std::span<const std::string> words) {
  const auto is_flag = [](const std::string& text) {
    return text.starts_with('-') && text.find_first_not_of('-') != std::string::npos;
  };
  const auto flag = std::find_if(unknown.begin(), unknown.end(), is_flag);
  if (flag == unknown.end()) {
    const std::string_view meant = closest_name(unknown.front(), words);
    return "'" + unknown.front() + "' is not expected here; " +
           (meant.empty() ? "--help lists what is" : "did you mean '" + std::string(meant) + "'?");
  }
  const std::string typed = flag->substr(0, flag->find('='));
  const std::string_view meant = closest_name(std::string_view(typed).substr(typed.find_first_not_of('-')), flags);
  return "there is no flag " + typed + "; " +
         (meant.empty() ? "--help lists all flags" : "did you mean --" + std::string(meant) + "?");
}

}  // namespace hairnet
