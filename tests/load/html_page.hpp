#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hairnet::load {

// The beginning of a page, up to its <body>, with the styles of tables and charts. The caller ends body and html.
std::string html_head(std::string_view title);

// All text is escaped.
std::string html_table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows);

}  // namespace hairnet::load
