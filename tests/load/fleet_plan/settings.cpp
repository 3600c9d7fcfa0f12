#include "tests/load/fleet_plan/settings.hpp"

#include <fmt/format.h>

namespace hairnet::fleet_plan {

std::string validate(const Settings& s) {
  if (s.deploy_h > 0 && s.deploy_h < 0.1) return "--deploy-h is 0, or 0.1 at least";
  if (s.mtbf_h > 0 && s.mtbf_h < 0.1) return "--mtbf-h is 0, or 0.1 at least";
  // The work of a run grows with the number of sessions. The limit keeps a run within minutes.
  const double mean_sessions = s.peak * s.days * 1440 / s.session_min;
  if (mean_sessions > 2e8)
    return fmt::format("{:.0f} million sessions are too many for a run: fewer people or days, or longer sessions",
                       mean_sessions / 1e6);
  return {};
}

}  // namespace hairnet::fleet_plan
