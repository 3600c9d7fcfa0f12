#include "tests/whole/fleet_chaos/machines.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "tests/whole/process.hpp"

namespace hairnet::whole {
namespace {

constexpr const char* kIp = "/usr/sbin/ip";
constexpr const char* kNft = "/usr/sbin/nft";
constexpr const char* kEnter = "/usr/bin/nsenter";
constexpr const char* kSetpriv = "/usr/bin/setpriv";

std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

int open_own_namespace() {
  return ::open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
}

std::string path_of(int descriptor) {
  return fmt::format("/proc/{}/fd/{}", ::getpid(), descriptor);
}

std::string missing_here() {
  if (::geteuid() != 0) return "network namespaces need root";
  for (const char* program : {kIp, kNft, kEnter, kSetpriv})
    if (::access(program, X_OK) != 0) return fmt::format("there is no {}; deploy/setup installs it", program);
  return {};
}

}  // namespace

const char* to_string(CutDirection direction) {
  static constexpr const char* kNames[] = {"both ways", "what it sends", "what it gets"};
  return kNames[static_cast<std::size_t>(direction)];
}

Result<std::unique_ptr<Machines>> Machines::create(std::size_t count, const std::string& folder) {
  if (std::string missing = missing_here(); !missing.empty()) return Refusal(std::move(missing));
  std::unique_ptr<Machines> machines(new Machines(folder));
  if (std::string fault = machines->make(count); !fault.empty()) return Refusal(std::move(fault));
  return machines;
}

// This program enters a network namespace of its own, makes one for each machine, and joins them by a bridge. Nothing
// outside of them is touched, and all of it goes with the process.
std::string Machines::make(std::size_t count) {
  const auto failed = [] { return fmt::format("cannot make a network namespace: {}", std::strerror(errno)); };
  if (::unshare(CLONE_NEWNET) != 0) return failed();
  const int own = open_own_namespace();
  for (std::size_t i = 0; i < count; ++i) {
    if (::unshare(CLONE_NEWNET) != 0) return failed();
    namespaces_.push_back(open_own_namespace());
    if (::setns(own, CLONE_NEWNET) != 0) return failed();
  }
  ::close(own);
  const std::string batch = folder_ + "/network.ip";
  {
    std::ofstream lines(batch);
    lines << "link add fleet type bridge\naddress add 10.77.0.254/16 dev fleet\nlink set fleet up\nlink set lo up\n"
          << "route add local 10.77.1.0/24 dev lo\n";
    for (std::size_t i = 0; i < count; ++i)
      lines << fmt::format(
          "link add machine{0} type veth peer name eth0 netns {1}\nlink set machine{0} master fleet up\n", i,
          path_of(namespaces_[i]));
  }
  if (std::string fault = run({kIp, "-batch", batch}); !fault.empty()) return fault;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string own_batch = fmt::format("{}/network{}.ip", folder_, i);
    std::ofstream(own_batch) << fmt::format("link set lo up\naddress add {}/16 dev eth0\nlink set eth0 up\n",
                                            address(i));
    if (std::string fault = run(on(i, {kIp, "-batch", own_batch})); !fault.empty()) return fault;
  }
  // Whether rules work here is known only now.
  if (count == 0) return {};
  if (std::string fault = cut(0, {0}, CutDirection::both); !fault.empty()) return fault;
  return heal(0);
}

Machines::~Machines() {
  for (const int descriptor : namespaces_) ::close(descriptor);
}

std::string Machines::address(std::size_t machine) const {
  return fmt::format("10.77.0.{}", machine + 1);
}

std::string Machines::client_address(std::size_t client) {
  // Machines have addresses in 10.77.0.0/24, and clients in 10.77.1.0/24. Clients far beyond 250 share an address.
  return fmt::format("10.77.1.{}", client % 250 + 1);
}

std::vector<std::string> Machines::on(std::size_t machine, const std::vector<std::string>& command) const {
  // The program ends with this one, also when this one is killed.
  std::vector<std::string> all{kSetpriv, "--pdeathsig", "KILL", kEnter, "--net=" + path_of(namespaces_[machine])};
  all.insert(all.end(), command.begin(), command.end());
  return all;
}

std::string Machines::cut(std::size_t machine, const std::vector<std::size_t>& peers, CutDirection direction) {
  std::string set;
  for (const std::size_t peer : peers) set += (set.empty() ? "" : ", ") + address(peer);
  std::string rules = "add table ip chaos;";
  if (direction != CutDirection::in)
    rules +=
        " add chain ip chaos sent { type filter hook output priority 0; };"
        " add rule ip chaos sent ip daddr { " +
        set + " } drop;";
  if (direction != CutDirection::out)
    rules +=
        " add chain ip chaos got { type filter hook input priority 0; };"
        " add rule ip chaos got ip saddr { " +
        set + " } drop;";
  return run(on(machine, {kNft, rules}));
}

std::string Machines::heal(std::size_t machine) {
  return run(on(machine, {kNft, "delete table ip chaos"}));
}

std::string Machines::run(const std::vector<std::string>& command) const {
  Process process(command, folder_ + "/network");
  const int code = process.wait(20);
  return code == 0 ? "" : fmt::format("{} failed with {}: {}", command.back(), code, first_line(process.err()));
}

}  // namespace hairnet::whole
