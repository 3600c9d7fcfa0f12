#pragma once

#include <map>
#include <string>
#include <string_view>

namespace hairnet::load {

// The samples of a Prometheus text exposition: `name{labels}` as it stands there -> value. Lines that are none are
// passed over.
using Exposition = std::map<std::string, double>;
Exposition parse_exposition(std::string_view text);

// The growth of counters, and of histograms' sums and counts; the newest value of everything else. For each histogram
// NAME also `NAME_mean`, the mean of the values added meanwhile.
Exposition exposition_between(const Exposition& from, const Exposition& to);

// The body of an HTTP/1 answer of status 200; empty when it is none.
std::string_view http_body(std::string_view answer);

}  // namespace hairnet::load
