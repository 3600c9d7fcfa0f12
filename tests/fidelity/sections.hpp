#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace hairnet::fidelity {

// The sections of hairnet-fidelity. Each adds its command to the program, and sets what runs it once it is chosen.
void add_decimation(CLI::App& program, std::function<int()>& chosen);
void add_learnt(CLI::App& program, std::function<int()>& chosen);
void add_levels(CLI::App& program, std::function<int()>& chosen);
void add_modes(CLI::App& program, std::function<int()>& chosen);
void add_motion(CLI::App& program, std::function<int()>& chosen);
void add_playout(CLI::App& program, std::function<int()>& chosen);
void add_robustness(CLI::App& program, std::function<int()>& chosen);
void add_solver(CLI::App& program, std::function<int()>& chosen);
void add_stride(CLI::App& program, std::function<int()>& chosen);
void add_swing(CLI::App& program, std::function<int()>& chosen);

}  // namespace hairnet::fidelity
