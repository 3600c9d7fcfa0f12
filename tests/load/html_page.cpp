#include "tests/load/html_page.hpp"

#include "tests/load/svg_chart.hpp"

namespace hairnet::load {
namespace {

constexpr std::string_view kBeforeTitle = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>)";
constexpr std::string_view kAfterTitle = R"(</title><style>
:root{--paper:#fff;--ink:#1c1d21;--faint:#6b6f78;--grid:#e4e6ea;--band:#f5f6f8;--good:#18794e;--bad:#b42318;
--c0:#2563eb;--c1:#d97706;--c2:#059669;--c3:#db2777;--c4:#7c3aed;--c5:#0891b2;--c6:#84cc16;--c7:#64748b}
@media (prefers-color-scheme:dark){:root{--paper:#15161a;--ink:#e8e9ec;--faint:#9a9ea8;--grid:#2c2e35;--band:#1b1d22;
--good:#4ade80;--bad:#f87171;--c0:#6ea0ff;--c1:#fbbf24;--c2:#34d399;--c3:#f472b6;--c4:#a78bfa;--c5:#22d3ee;--c6:#a3e635;
--c7:#94a3b8}}
body{background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif;max-width:1560px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem;margin:0}h2{font-size:1.1rem;margin:2rem 0 .5rem}p.sub{color:var(--faint);margin:.2rem 0}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,560px),1fr));gap:1rem 2rem}
figure{margin:0}figcaption{font-weight:600}svg{width:100%;height:auto;display:block}
.grid{stroke:var(--grid)}.band{fill:var(--band)}.tick,.note{fill:var(--faint);font-size:11px}
.line{fill:none;stroke:var(--c);stroke-width:1.6;stroke-linejoin:round}.area{fill:var(--c);fill-opacity:.75;stroke:none}
.legend{margin:.1rem 0 0;font-size:.8rem;color:var(--faint)}.legend span{margin-right:1rem;white-space:nowrap}
.legend span::before{content:"";display:inline-block;width:.7em;height:.7em;margin-right:.35em;background:var(--c)}
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:.85rem;font-variant-numeric:tabular-nums}
th,td{padding:.2rem .7rem;text-align:right;border-bottom:1px solid var(--grid);white-space:nowrap}
th:first-child,td:first-child{text-align:left}th{color:var(--faint);font-weight:500}
.good{color:var(--good)}.bad{color:var(--bad)}pre{white-space:pre-wrap;font-size:.8rem;color:var(--faint)}
details{margin:.5rem 0}
</style></head><body>
)";

}  // namespace

std::string html_head(std::string_view title) {
  return std::string(kBeforeTitle) + escaped(title) + std::string(kAfterTitle);
}

std::string html_table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"wide\"><table><thead><tr>";
  for (const std::string& cell : head) html += "<th>" + escaped(cell) + "</th>";
  html += "</tr></thead><tbody>";
  for (const auto& row : rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escaped(cell) + "</td>";
    html += "</tr>";
  }
  return html + "</tbody></table></div>\n";
}

}  // namespace hairnet::load
