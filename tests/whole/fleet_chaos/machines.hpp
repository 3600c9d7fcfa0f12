#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hairnet::whole {

// Which packets of a machine get lost.
enum class CutDirection : std::uint8_t { both, out, in };
const char* to_string(CutDirection direction);

// Machines of a test: network namespaces with one interface each, on a bridge in a namespace of this process. None has
// a name, and this process's own network is left as it was, so nothing remains when the process ends. Linux and root
// only.
class Machines {
 public:
  // This process moves into the bridge's namespace: call it before other threads start. `folder` takes the output of
  // the programs that are used. The error is one line, about what is missing here.
  static Result<std::unique_ptr<Machines>> create(std::size_t count, const std::string& folder);
  ~Machines();
  Machines(const Machines&) = delete;
  Machines& operator=(const Machines&) = delete;

  [[nodiscard]] std::string address(std::size_t machine) const;
  // Returns an address of this process, from which client number `client` may connect.
  [[nodiscard]] static std::string client_address(std::size_t client);
  // Returns a command that runs `command` on the machine. The program that it starts is killed when this process ends.
  [[nodiscard]] std::vector<std::string> on(std::size_t machine, const std::vector<std::string>& command) const;

  // From now on the machine's packets to or from `peers` get lost, until heal(). Returns one line when it fails.
  std::string cut(std::size_t machine, const std::vector<std::size_t>& peers, CutDirection direction);
  std::string heal(std::size_t machine);

 private:
  explicit Machines(std::string folder) : folder_(std::move(folder)) {}
  std::string make(std::size_t count);
  std::string run(const std::vector<std::string>& command) const;

  std::string folder_;
  // The file descriptors of the machines' namespaces.
  std::vector<int> namespaces_;
};

}  // namespace hairnet::whole
