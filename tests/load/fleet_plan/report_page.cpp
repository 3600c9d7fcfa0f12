#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tests/load/fleet_plan/report.hpp"
#include "tests/load/html_page.hpp"
#include "tests/load/svg_chart.hpp"

namespace hairnet::fleet_plan {
namespace {

using load::Chart;
using load::ChartLine;

class Charts {
 public:
  Charts(const Settings& settings, const Outcome& outcome) : outcome_(outcome) {
    for (int day = 0; day < settings.days; ++day)
      bands_.push_back({24.0 * day, std::min(24.0 * (day + 1), 24 * settings.days), fmt::format("day {}", day + 1)});
  }

  std::string draw_all() const {
    return draw_people() + draw_servers() + draw_load() + draw_egress() + draw_etcd() + draw_moves() + draw_outages() +
           draw_joins();
  }

 private:
  template <class Of>
  ChartLine over_time(std::string label, Of of) const {
    ChartLine line{std::move(label), {}};
    for (const Sample& sample : outcome_.samples) line.points.emplace_back(sample.hour, of(sample));
    return line;
  }
  Chart time_chart(std::string title, std::string y_label, std::vector<ChartLine> lines) const {
    // The three flags are those of Chart: no logarithmic axis, and lines that are not stacked.
    return {std::move(title), "hours", std::move(y_label), false, false, false, std::move(lines), bands_};
  }

  std::string draw_people() const {
    return draw(time_chart("People", "at once",
                           {over_time("in rooms or waiting", [](const Sample& s) { return s.people; }),
                            over_time("waiting for a server", [](const Sample& s) { return s.waiting; })}));
  }

  std::string draw_servers() const {
    return draw(time_chart("Servers", "",
                           {over_time("needed, evenly loaded", [](const Sample& s) { return s.servers_needed; }),
                            over_time("running", [](const Sample& s) { return s.servers_running; })}));
  }

  std::string draw_load() const {
    return draw(time_chart(
        "Load of a server, % of its budget", "",
        {over_time("mean", [](const Sample& s) { return 100 * s.used_share; }),
         over_time("fullest (above 100: coarser hair)", [](const Sample& s) { return 100 * s.used_share_max; })}));
  }

  std::string draw_egress() const {
    return draw(time_chart("From all servers to clients", "Gbit/s",
                           {over_time("egress", [](const Sample& s) { return s.egress_bytes_per_s * 8 / 1e9; })}));
  }

  std::string draw_etcd() const {
    Chart chart = time_chart("etcd", "a second", {});
    chart.log_y = true;
    for (std::size_t i = 0; i < kEtcdWriteCount; ++i) {
      // Servers ask for a lease a few times a day, too rarely for a plot of requests a second.
      if (i == static_cast<std::size_t>(EtcdWrite::lease)) continue;
      chart.lines.push_back(over_time(std::string(kEtcdWriteNames[i]), [i](const Sample& s) {
        return static_cast<double>(s.etcd.writes[i]) / s.seconds;
      }));
    }

    chart.lines.push_back(over_time(
        "messages to watches", [](const Sample& s) { return static_cast<double>(s.etcd.watch_events) / s.seconds; }));
    return draw(chart);
  }

  std::string draw_moves() const {
    Chart chart = time_chart("Rooms that went to another server", "in all so far", {});
    for (std::size_t i = 0; i < kMoveCauseCount; ++i) {
      ChartLine line{std::string(kMoveCauseNames[i]), {}};
      double sum = 0;
      for (const Sample& s : outcome_.samples)
        line.points.emplace_back(s.hour, sum += static_cast<double>(s.rooms_moved[i]));
      chart.lines.push_back(std::move(line));
    }
    return draw(chart);
  }

  static ChartLine tail(std::string label, const load::LatencyHistogram& times) {
    ChartLine line{std::move(label), times.tail()};
    // The histogram has milliseconds, and the charts show seconds.
    for (auto& [time, share] : line.points) time /= 1e3;
    return line;
  }

  std::string draw_outages() const {
    // Both axes are logarithmic, since waits last from milliseconds to minutes and the rare long ones matter.
    Chart chart{"Share of people whose hair stands still for longer after a move",
                "seconds",
                "share",
                true,
                true,
                false,
                {},
                {}};
    for (std::size_t i = 0; i < kMoveCauseCount; ++i)
      chart.lines.push_back(tail(std::string(kMoveCauseNames[i]), outcome_.hair_away[i]));
    return draw(chart);
  }

  std::string draw_joins() const {
    return draw(Chart{"Share of arrivals that waited longer for hair",
                      "seconds",
                      "share",
                      true,
                      true,
                      false,
                      {tail("from arrival to hair", outcome_.join)},
                      {}});
  }

  const Outcome& outcome_;
  // The days of the simulation, of which the charts over time shade every second one.
  std::vector<load::ChartBand> bands_;
};

std::string cost_table(const ServerCosts& costs) {
  std::vector<std::vector<std::string>> rows;
  for (const CostFigure& cost : cost_figures())
    rows.push_back({std::string(cost.meaning), number_text(costs.*cost.value) + " " + std::string(cost.unit),
                    std::string(cost.flag), std::string(cost.source)});
  return load::html_table({"cost", "value", "flag", "source of the default"}, rows);
}

}  // namespace

std::string to_page(const Settings& settings, const Outcome& outcome, const std::string& command) {
  std::string html = load::html_head("hairnet-fleet-plan");
  html += fmt::format("<h1>hairnet-fleet-plan</h1><p><strong>{}</strong></p><p class=\"sub\">{}</p>\n",
                      load::escaped(to_sentence(settings, outcome)), load::escaped(command));
  html += "<div class=\"charts\">" + Charts(settings, outcome).draw_all() +
          "</div>\n<h2>Figures</h2><div class=\"charts\">";
  for (const FigureGroup& group : figures(outcome)) {
    std::vector<std::vector<std::string>> rows;
    for (const Figure& figure : group.figures)
      rows.push_back({figure.meaning, number_text(figure.value) + (figure.unit.empty() ? "" : " ") + figure.unit});
    html += load::html_table({group.title, ""}, rows);
  }
  return html + "</div>\n<h2>Costs</h2>" + cost_table(settings.costs) + "</body></html>\n";
}

}  // namespace hairnet::fleet_plan
