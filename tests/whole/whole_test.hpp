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

// A folder of its own and the programs, by their names.
class WholeTest : public ::testing::Test {
 protected:
  using Arguments = std::vector<std::string>;
  void SetUp() override;
  // Keeps the folder of a failed test.
  void TearDown() override;

  // Belongs to the server started last.
  [[nodiscard]] std::uint16_t port() const { return static_cast<std::uint16_t>(std::stoi(port_)); }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  // Returns once the server listens. `name` is of its files: output, port. `descriptor`: as of Process.
  std::unique_ptr<Process> start_server(const Arguments& more = {}, const std::string& name = "server",
                                        int descriptor = -1);
  // hairnet-view, connected to the server started last.
  std::unique_ptr<Process> start_view(const Arguments& more, const std::string& name = "view");
  std::unique_ptr<Process> start(const std::string& program, const Arguments& arguments, const std::string& name,
                                 int descriptor = -1);
  // Runs to the end; a code other than `exit_code` is a failure with the program's output.
  void finish(Process& process, int exit_code);
  // SIGTERM, and the end of it.
  void drain(Process& server);
  // Checks that every frame in the client's trace shows the replay's hair, as near as the client has asked for.
  FrameComparison expect_same_frames(const std::string& received_folder, const std::string& computed_folder);
  // Gives this learnt hair to all grooms that the servers of this test have built.
  void put_learnt_hair(const LearntHair& hair);
  // Until `path` is a file of at least `bytes`; false after a long while, or once `process` has ended.
  bool wait_for_file(const std::string& path, std::size_t bytes, Process& process);

 private:
  struct BuiltGroom {
    std::string file;
    wire::GroomHash hash{};
    std::shared_ptr<LevelSet> levels;
  };
  // By the servers of this test.
  [[nodiscard]] std::vector<BuiltGroom> built_grooms() const;

  std::filesystem::path folder_;
  bool has_put_learnt_hair_ = false;
  std::string port_;
};

// "hairnet-x: reason" and nothing else.
bool is_one_line(const std::string& text);

}  // namespace hairnet::whole
