#pragma once

#include <cstdio>
#include <string>

#include "tests/load/run.hpp"

namespace hairnet::load {

// Shows a run: one screen that is redrawn, or, if stdout is not a terminal, a line every few seconds.
class LiveView {
 public:
  LiveView(std::FILE* out, bool is_terminal) : out_(out), is_terminal_(is_terminal) {}
  void show(const RunProgress& progress);
  // Leaves the last picture on the screen.
  void end();

 private:
  std::FILE* out_;
  bool is_terminal_;
  // The number of lines of the last drawing.
  int lines_ = 0;
  double shown_s_ = -1e9;
};

std::string to_line(const RunProgress& progress);
std::string to_screen(const RunProgress& progress);

}  // namespace hairnet::load
