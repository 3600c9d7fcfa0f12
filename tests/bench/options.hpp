#pragma once

#include <string>
#include <variant>
#include <vector>

namespace hairnet::bench {

enum class Section : std::uint8_t { paper, ffd, accuracy, crowd, codec };

struct Options {
  std::string groom = "made:long_straight";
  // Times are of the first.
  std::vector<std::string> motions{"made:dance", "made:run", "made:look_around"};
  std::vector<Section> sections{Section::paper, Section::ffd, Section::accuracy, Section::crowd, Section::codec};
  std::string isa = "best";
  // Counts the crowd's threads; zero takes as many as the machine has.
  std::size_t threads = 0;
  // Each time is taken so often, and the least counts.
  int repetitions = 7;
  // Counts the characters of the paper's table.
  std::size_t characters = 64;
  std::size_t crowd_high = 1024, crowd_low = 4096, memory_low = 10'000;
  // Limits the naive solver's iterations on its way to the error of the shipped one.
  int naive_iterations_max = 1024;
  // Leaves out cells of the paper's table that are none of our levels.
  bool shipped_cells_only = false;
  // Is how much of each motion errors are measured over.
  double duration_s = 4;
  // Name files; empty writes none.
  std::string json, csv;
  // Names a level: then only its steps run, for valgrind.
  std::string callgrind;
  std::string kernel = "crowd";
  int callgrind_steps = 4;
};

// The options, or the exit code when there is nothing more to do.
std::variant<Options, int> parse_options(int argc, char** argv);

}  // namespace hairnet::bench
