#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "core/solver/wind.hpp"

namespace hairnet {

// Adds the flags of a Wind. Fills `wind` while parsing; it must outlive the parsing, and the caller must validate it
// afterwards. Returns the flags, so that a program can check whether any was given: still air that was asked for
// differs from no wish.
inline CLI::Option_group* add_wind_flags(CLI::App& app, Wind& wind) {
  CLI::Option_group* flags = app.add_option_group("Wind");
  flags
      ->add_option_function<std::vector<double>>(
          "--wind", [&wind](const std::vector<double>& v) { wind.mean_m_per_s = Vec3(v[0], v[1], v[2]); },
          "its mean, m/s, world: X Y Z (0 0 0)")
      ->expected(3);
  flags->add_option("--gust", wind.gust_ratio, "by what share of itself the mean comes and goes, 0 to 1 (0)");
  flags->add_option("--gust-period", wind.gust_period_s, "seconds of the slowest gust (4)");
  flags->add_option("--turbulence", wind.turbulence_rms_m_per_s, "m/s of each component, root mean square (0)");
  flags->add_option("--turbulence-scale", wind.turbulence_scale_m, "metres over which turbulence changes (0.6)");
  flags->add_option("--wind-seed", wind.seed, "another seed, another turbulence (1)");
  flags->add_flag("--wind-carried", wind.carried, "the air goes along with the head, as in a vehicle");
  return flags;
}

}  // namespace hairnet
