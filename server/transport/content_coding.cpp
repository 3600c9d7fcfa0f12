#include "server/transport/content_coding.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>

namespace hairnet::server {
namespace {

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  text.remove_suffix(text.size() - std::min(text.find_last_not_of(" \t") + 1, text.size()));
  return text;
}

bool same_word(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

// Takes the text up to `separator` off the front.
std::string_view take(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = trimmed(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

// The weight in [0, 1] of "gzip;q=0.5" is 0.5, and of "gzip" 1. None when it cannot be read.
std::optional<double> weight_of(std::string_view parameters) {
  double weight = 1;
  while (!parameters.empty()) {
    std::string_view value = take(parameters, ';');
    if (!same_word(take(value, '='), "q")) continue;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), weight);
    if (error != std::errc() || end != value.data() + value.size() || !(weight >= 0 && weight <= 1))
      return std::nullopt;
  }
  return weight;
}

// "x-gzip" is an old name that recipients should take for gzip (RFC 9110, section 8.4.1.3).
bool names(std::string_view word, ContentCoding coding) {
  if (coding == ContentCoding::identity) return same_word(word, "identity");
  return same_word(word, name_of(coding).token) || (coding == ContentCoding::gzip && same_word(word, "x-gzip"));
}

}  // namespace

ContentCodingName name_of(ContentCoding coding) {
  switch (coding) {
    case ContentCoding::brotli:
      return {"br", ".br"};
    case ContentCoding::gzip:
      return {"gzip", ".gz"};
    case ContentCoding::identity:
      break;
  }
  return {};
}

std::vector<ContentCoding> accepted_codings(std::string_view accept_encoding) {
  constexpr std::array kCodings{ContentCoding::brotli, ContentCoding::gzip, ContentCoding::identity};
  std::array<std::optional<double>, kCodings.size()> weights;
  // The weight of "*", which stands for every coding that the field does not name.
  std::optional<double> other;
  while (!accept_encoding.empty()) {
    std::string_view item = take(accept_encoding, ',');
    const std::string_view word = take(item, ';');
    const std::optional<double> weight = weight_of(item);
    // A word that cannot be read may mean anything; without it the client gets a coding that it has named, or plain
    // bytes.
    if (!weight) continue;
    if (word == "*") other = weight;
    for (std::size_t i = 0; i < kCodings.size(); ++i)
      if (names(word, kCodings[i])) weights[i] = weight;
  }
  for (std::size_t i = 0; i + 1 < kCodings.size(); ++i)
    if (!weights[i]) weights[i] = other.value_or(0);
  // A client that does not name `identity` takes plain bytes last.
  const double plain = weights.back().value_or(0);
  std::vector<ContentCoding> accepted;
  for (std::size_t i = 0; i + 1 < kCodings.size(); ++i)
    // A client that prefers plain bytes gets them. At the same weight the compressed copy is smaller.
    if (*weights[i] > 0 && *weights[i] >= plain) accepted.push_back(kCodings[i]);
  // The sort is stable, so brotli stays before gzip where their weights are equal.
  std::ranges::stable_sort(accepted, std::ranges::greater(),
                           [&](ContentCoding coding) { return *weights[static_cast<std::size_t>(coding)]; });
  accepted.push_back(ContentCoding::identity);
  return accepted;
}

}  // namespace hairnet::server
