#pragma once

#include <string>
#include <variant>
#include <vector>

namespace hairnet::bench {

enum class Section : std::uint8_t { paper, ffd, accuracy, crowd, codec };

struct Options {
  std::string groom = "made:long_straight";
  // Times are measured on the first motion, errors on all of them.
  std::vector<std::string> motions{"made:dance", "made:run", "made:look_around"};
  std::vector<Section> sections{Section::paper, Section::ffd, Section::accuracy, Section::crowd, Section::codec};
  std::string isa = "best";
  // The number of the crowd's threads; zero takes as many as the machine has.
  std::size_t threads = 0;
  // Each time is measured so often, and the shortest counts.
  int repetitions = 7;
  // The number of characters in the paper's table.
  std::size_t characters = 64;
  // The numbers of characters in the crowds of the high and the low level, and in the measurement of memory.
  std::size_t crowd_high = 1024, crowd_low = 4096, memory_low = 10'000;
  // The most iterations of the naive solver on its way to the error of the shipped one.
  int naive_iterations_max = 1024;
  // Leaves out cells of the paper's table that are none of our levels.
  bool shipped_cells_only = false;
  // Errors are measured over so much of each motion.
  double duration_s = 4;
  // The files for the results; no file is written for an empty name.
  std::string json, csv;
  // The name of a level, or "touch". If there is one, nothing is measured: `callgrind_steps` steps of this level run
  // with the kernel "crowd" or "single", for valgrind to count (count_instructions), or as many ticks of a room
  // (count_touch_instructions).
  std::string callgrind;
  std::string kernel = "crowd";
  int callgrind_steps = 4;
  // Valgrind's file of output, whose dumps have the counts of "touch". They are not printed for an empty name.
  std::string dumps;
};

// The options, or the exit code when there is nothing more to do.
std::variant<Options, int> parse_options(int argc, char** argv);

}  // namespace hairnet::bench
