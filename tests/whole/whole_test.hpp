#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/learnt/learnt_hair.hpp"
#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"
#include "tests/whole/frame_comparison.hpp"
#include "tests/whole/process.hpp"

namespace hairnet::whole {

// The fixture of tests that start real programs. Each test has a folder of its own for their files.
class WholeTest : public ::testing::Test {
 protected:
  using Arguments = std::vector<std::string>;
  void SetUp() override;
  // Keeps the folder of a failed test.
  void TearDown() override;

  // The port of the server that was started last.
  [[nodiscard]] std::uint16_t port() const { return static_cast<std::uint16_t>(std::stoi(port_)); }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  // Starts a server on a free port and returns once it listens. `name` is that of its files: the output and the port.
  // `descriptor` is as in Process.
  std::unique_ptr<Process> start_server(const Arguments& more = {}, const std::string& name = "server",
                                        int descriptor = -1);
  // Starts hairnet-view, connected to the server that was started last.
  std::unique_ptr<Process> start_view(const Arguments& more, const std::string& name = "view");
  std::unique_ptr<Process> start(const std::string& program, const Arguments& arguments, const std::string& name,
                                 int descriptor = -1);
  // Waits for the program's end. An exit code other than `exit_code` fails the test, with the program's output.
  void finish(Process& process, int exit_code);
  // Sends SIGTERM to the server and waits until it has ended with the exit code 0.
  void drain(Process& server);
  // Checks that every frame in the client's trace shows the replay's hair, as near as the client has asked for.
  FrameComparison expect_same_frames(const std::string& received_folder, const std::string& computed_folder);
  // Gives this learnt hair to all grooms that the servers of this test have built.
  void put_learnt_hair(const LearntHair& hair);
  // Waits until `path` is a file of at least `bytes`. Returns false after some minutes, or once `process` has ended.
  bool wait_for_file(const std::string& path, std::size_t bytes, Process& process);

 private:
  struct BuiltGroom {
    std::string file;
    wire::GroomHash hash{};
    std::shared_ptr<LevelSet> levels;
  };
  // Returns the levels that the servers of this test have built.
  [[nodiscard]] std::vector<BuiltGroom> built_grooms() const;

  std::filesystem::path folder_;
  bool has_put_learnt_hair_ = false;
  std::string port_;
};

// Returns whether the text is one line like "hairnet-view: reason" and nothing else.
bool is_one_line(const std::string& text);

}  // namespace hairnet::whole
