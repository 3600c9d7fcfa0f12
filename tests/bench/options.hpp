#pragma once

#include <string>
#include <variant>
#include <vector>

namespace hairnet::bench {

enum class Section : std::uint8_t { paper, ffd, accuracy, crowd, codec };

struct Options {
  std::string groom = "made:long_straight";
  std::vector<std::string> motions{"made:dance", "made:run", "made:look_around"};  // times are of the first
  std::vector<Section> sections{Section::paper, Section::ffd, Section::accuracy, Section::crowd, Section::codec};
  std::string isa = "best";
  std::size_t threads = 0;      // of the crowd; 0: the machine's
  int repetitions = 7;          // of each time: the least counts
  std::size_t characters = 64;  // of the paper's table
  std::size_t crowd_high = 1024, crowd_low = 4096, memory_low = 10'000;
  int naive_iterations_max = 1024;  // largest number for the naive solver to reach the error of the shipped one
  bool shipped_cells_only = false;  // only cells of the paper's table that are our levels
  double duration_s = 4;            // of each motion, for errors
  std::string json, csv;            // files, or empty
  std::string callgrind;            // level name: steps alone, for valgrind
  std::string kernel = "crowd";
  int callgrind_steps = 4;
};

// The options, or the exit code when there is nothing more to do.
std::variant<Options, int> parse_options(int argc, char** argv);

}  // namespace hairnet::bench
