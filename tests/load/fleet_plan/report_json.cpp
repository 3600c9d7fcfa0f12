#include <nlohmann/json.hpp>

#include "tests/load/fleet_plan/report.hpp"

namespace hairnet::fleet_plan {
namespace {

using Json = nlohmann::ordered_json;

Json settings_json(const Settings& s) {
  Json json{{"seed", s.seed},
            {"days", s.days},
            {"peak", s.peak},
            {"night", s.night_share},
            {"peak_hour", s.peak_hour},
            {"session_min", s.session_min},
            {"session_sigma", s.session_sigma},
            {"patience_s", s.patience_s},
            {"rooms", s.rooms},
            {"zipf", s.zipf},
            {"room_cap", s.room_cap},
            {"room_tries", s.room_tries},
            {"observe", s.observe},
            {"hairstyles", s.hairstyles},
            {"level", kHairLevelNames[static_cast<std::size_t>(s.level)]},
            {"cores", s.cores},
            {"budget_share", s.budget_share},
            {"overload_max", s.overload_max},
            {"characters_max", s.characters_max},
            {"lease_s", s.lease_s},
            {"balance", s.balance},
            {"mtbf_h", s.mtbf_h},
            {"deploy_h", s.deploy_h},
            {"deploy_share", s.deploy_share},
            {"servers", s.servers},
            {"servers_min", s.servers_min},
            {"buffer", s.buffer},
            {"start_s", s.start_s},
            {"scale_in_s", s.scale_in_s}};
  for (const CostFigure& cost : cost_figures())
    json["costs"][std::string(cost.flag.substr(2))] = {
        {"value", s.costs.*cost.value}, {"unit", cost.unit}, {"measured", cost.is_measured}, {"source", cost.source}};
  return json;
}

Json sample_json(const Sample& s) {
  Json json{{"hour", s.hour},
            {"people", s.people},
            {"waiting", s.waiting},
            {"servers_needed", s.servers_needed},
            {"servers_running", s.servers_running},
            {"used_share", s.used_share},
            {"used_share_max", s.used_share_max},
            {"egress_bytes_per_s", s.egress_bytes_per_s},
            {"etcd_requests_per_s", static_cast<double>(s.etcd.total()) / s.seconds},
            {"watch_messages_per_s", static_cast<double>(s.etcd.watch_events) / s.seconds}};
  for (std::size_t i = 0; i < kMoveCauseCount; ++i)
    json["rooms_moved"][std::string(kMoveCauseNames[i])] = s.rooms_moved[i];
  return json;
}

}  // namespace

std::string to_json_text(const Settings& settings, const Outcome& outcome, const std::string& command) {
  Json json{{"command", command}, {"settings", settings_json(settings)}, {"figures", Json::object()}};
  for (const FigureGroup& group : figures(outcome))
    for (const Figure& figure : group.figures) json["figures"][figure.name] = figure.value;
  json["samples"] = Json::array();
  for (const Sample& sample : outcome.samples) json["samples"].push_back(sample_json(sample));
  return json.dump(1) + "\n";
}

}  // namespace hairnet::fleet_plan
