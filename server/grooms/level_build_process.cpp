#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/level_file.hpp"
#include "schema/wire/packing.hpp"
#include "server/files/descriptor.hpp"
#include "server/grooms/build_pool.hpp"
#include "server/grooms/level_build.hpp"

// The two processes talk over a pair of sockets. The child gets a Request and the groom's file, and
// answers with one byte, a BuildError, followed by the level file or the error's detail.

extern char** environ;

namespace hairnet::server {
namespace {

// What the parent writes first; the groom's file follows. Both ends are the same program, so the struct travels as its
// bytes.
struct Request {
  std::array<char, 8> magic;
  wire::GroomHash hash;
  GroomLimits groom;
  std::uint64_t thread_count, memory_bytes_max;
  std::int64_t ns_max;
  ModeTraining training;
  std::uint64_t file_bytes, unpacked_bytes;
};
static_assert(std::is_trivially_copyable_v<Request>);

// A person who starts the program with the flag by hand gets a message instead of a program that waits for bytes. The
// number changes with the struct.
constexpr std::array<char, 8> kMagic{'h', 'n', 'b', 'u', 'i', 'l', 'd', '4'};
// The parent checks this often whether the build may go on. A shorter period would cost time; a longer one would let a
// dropped build run on.
constexpr int kLookPeriod_ms = 20;
// The status by which a child says that an allocation failed: it has no memory left to say more.
constexpr int kExitNoMemory = 3;
// The child may use this memory beside that of the build (RLIMIT_DATA in confine): for the program; for the stack and
// the allocator of each thread; and, for each byte of the unpacked groom, 6 bytes, because the groom is in memory
// unpacked, as integers and decoded.
constexpr std::uint64_t kProcessBytes = std::uint64_t{64} << 20, kThreadBytes = std::uint64_t{16} << 20,
                        kBytesPerUnpackedByte = 6;
// The memory that the search for the modes takes.
constexpr std::uint64_t kModeBytes = std::uint64_t{256} << 20;

// Owns the child process. The destructor kills and reaps it, whichever way the build is left.
class Child {
 public:
  explicit Child(pid_t id) : id_(id) {}
  ~Child() {
    if (id_ <= 0) return;
    kill(id_, SIGKILL);
    wait();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  // Waits for the end of the child, and returns its status (waitpid).
  int wait() {
    int status = 0;
    while (waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = 0;
    return status;
  }

 private:
  pid_t id_;
};

// Starts this program as a child whose standard input and output are `socket`. Returns the system's error, or 0.
int spawn(int socket, pid_t& child) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, socket, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, socket, STDOUT_FILENO);
  // The child gets neither the server's sockets nor its files: a groom that took the child over would hold nothing but
  // its own socket and standard error.
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_init(&attributes);
  // The server blocks and handles signals in its own way; the child begins with none blocked and all at their default.
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  // A group of its own, so that Ctrl-C at a terminal reaches the parent only, which then decides.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::array<char, 16> name{"hairnet-build"};
  std::string flag = kLevelBuildFlag;
  std::array<char*, 3> arguments{name.data(), flag.data(), nullptr};
  // /proc/self/exe is the file of this program, even if a new version has replaced it on disk meanwhile. posix_spawn
  // and not fork: fork of a large process with many threads is slow, and may copy a held lock.
  const int error = posix_spawn(&child, "/proc/self/exe", &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

// Sends the request and the file while it receives the answer. It does both at once, because a child that ends early
// stops reading: a parent that only wrote would block.
BuildError exchange(int socket, std::span<const std::uint8_t> request, std::span<const std::uint8_t> file,
                    std::vector<std::uint8_t>& answer, const GoesOn& goes_on) {
  std::array<std::uint8_t, 1 << 16> piece;
  while (true) {
    if (const BuildError error = goes_on(); error != BuildError::none) return error;
    std::span<const std::uint8_t>& next = request.empty() ? file : request;
    pollfd look{socket, static_cast<short>(next.empty() ? POLLIN : POLLIN | POLLOUT), 0};
    if (::poll(&look, 1, kLookPeriod_ms) <= 0) continue;
    // MSG_NOSIGNAL: a child that has ended must not end the server by SIGPIPE.
    if (look.revents & POLLOUT) {
      const ssize_t sent = ::send(socket, next.data(), next.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0) next = next.subspan(static_cast<std::size_t>(sent));
    }
    if (!(look.revents & (POLLIN | POLLHUP | POLLERR))) continue;
    const ssize_t received = ::recv(socket, piece.data(), piece.size(), MSG_DONTWAIT);
    // The child has closed its end: its status says the rest.
    if (received == 0 || (received < 0 && errno != EAGAIN && errno != EINTR)) return BuildError::none;
    if (received > 0) answer.insert(answer.end(), piece.begin(), piece.begin() + received);
    // The child's answer is not trusted either: it may not fill the server's memory. One byte is the error's code.
    if (answer.size() > wire::kLevelFileBytesMax + 1) return BuildError::memory;
  }
}

std::string memory_detail(const LevelBuildDef& def) {
  return fmt::format("its build takes more than {} MiB of memory", def.memory_bytes_max >> 20);
}

LevelBuild failed_build(BuildError error, std::string detail = {}) {
  return {nullptr, error, std::move(detail)};
}

std::string how_it_ended(int status) {
  return WIFSIGNALED(status) ? fmt::format("by signal {}", WTERMSIG(status))
                             : fmt::format("with status {}", WEXITSTATUS(status));
}

// Whether the groom is not the cause of the end: the kernel was out of memory, a person or a supervisor has ended the
// process, or the program could not be loaded.
bool is_from_outside(int status) {
  // A program that the loader cannot load ends with this status.
  constexpr int kExitNotLoaded = 127;
  if (WIFEXITED(status)) return WEXITSTATUS(status) == kExitNotLoaded;
  const std::array<int, 5> from_outside{SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT};
  return std::ranges::find(from_outside, WTERMSIG(status)) != from_outside.end();
}

// The functions from here to answer() run in the child.

[[noreturn]] void end_without_memory() {
  ::_exit(kExitNoMemory);
}

// Lowers a limit of this process; a limit that is lower already stays.
void limit(__rlimit_resource resource, std::uint64_t value) {
  rlimit limits{};
  getrlimit(resource, &limits);
  limits.rlim_cur = std::min<rlim_t>(value, limits.rlim_max);
  setrlimit(resource, &limits);
}

// Gives the child its limits of memory, time and files, before it reads a byte of the groom.
void confine(const Request& request) {
  // A build whose server has died would go on for minutes for nobody.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // A crash leaves no core file, and the child can make no file grow.
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  // The processor's time counts over all threads. It ends a build even if the parent stands still.
  limit(RLIMIT_CPU, 2 + static_cast<std::uint64_t>(request.ns_max) / 1'000'000'000 * request.thread_count);
// A sanitizer takes far more memory than the build itself.
#ifndef HAIRNET_SANITIZE_ON
  limit(RLIMIT_DATA, kProcessBytes + kThreadBytes * request.thread_count + request.file_bytes +
                         kBytesPerUnpackedByte * request.unpacked_bytes + kModeBytes + request.memory_bytes_max);
#endif
  // When the machine itself is out of memory, the kernel ends this process first and not the server.
  if (const Descriptor score(::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC)); score)
    static_cast<void>(!::write(score.get(), "1000", 4));
  // A failed allocation ends the process at once, wherever it happens; the status tells the parent.
  std::set_new_handler(end_without_memory);
}

// Reads exactly `size` bytes from the parent. False: the parent has closed its end.
bool receive_all(void* to, std::size_t size) {
  auto* at = static_cast<std::uint8_t*>(to);
  while (size > 0) {
    const ssize_t count = ::read(STDIN_FILENO, at, size);
    if (count <= 0) return false;
    at += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

// The answer is one byte, the error, and then the levels, or a line of text about the error. The end of the stream ends
// it.
int answer(BuildError error, std::span<const std::uint8_t> bytes) {
  const auto code = static_cast<std::uint8_t>(error);
  bool is_sent = ::send(STDOUT_FILENO, &code, 1, MSG_NOSIGNAL) == 1;
  while (is_sent && !bytes.empty()) {
    const ssize_t count = ::send(STDOUT_FILENO, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    is_sent = count > 0;
    if (is_sent) bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return is_sent ? EXIT_SUCCESS : EXIT_FAILURE;
}

int answer(BuildError error, const std::string& detail) {
  return answer(error, {reinterpret_cast<const std::uint8_t*>(detail.data()), detail.size()});
}

}  // namespace

LevelBuild build_levels_in_child_process(const LevelBuildDef& def, const wire::GroomHash& hash,
                                         std::span<const std::uint8_t> file, const Groom& groom,
                                         const GoesOn& goes_on) {
  HAIRNET_ASSERT(goes_on);
  HAIRNET_ASSERT(!file.empty());
  std::array<int, 2> pair{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0)
    return failed_build(BuildError::server, fmt::format("no sockets for its build: {}", std::strerror(errno)));
  const Descriptor ours(pair[0]);
  Descriptor theirs(pair[1]);
  pid_t id = 0;
  if (const int error = spawn(theirs.get(), id); error != 0)
    return failed_build(BuildError::server, fmt::format("no process for its build: {}", std::strerror(error)));
  Child child(id);
  // Only the child holds the other end now, so its death ends the stream.
  theirs.close();
  const Request request{kMagic,
                        hash,
                        def.groom,
                        def.thread_count,
                        def.memory_bytes_max,
                        def.ns_max,
                        def.training,
                        file.size(),
                        wire::unpacked_bytes(file, wire::kPackedGroom)};
  std::vector<std::uint8_t> answer;
  const BuildError error =
      exchange(ours.get(), {reinterpret_cast<const std::uint8_t*>(&request), sizeof(request)}, file, answer, goes_on);
  if (error != BuildError::none) return failed_build(error, error == BuildError::memory ? memory_detail(def) : "");
  // The child has closed its socket, so it is about to end.
  const int status = child.wait();
  // The order of these checks is from the surest sign to the least sure: a status of our own, the kernel's limit of
  // time, then any other end.
  if (WIFEXITED(status) && WEXITSTATUS(status) == kExitNoMemory)
    return failed_build(BuildError::memory, memory_detail(def));
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return failed_build(BuildError::time);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != EXIT_SUCCESS || answer.empty())
    return failed_build(is_from_outside(status) ? BuildError::server : BuildError::crash,
                        "its build ended " + how_it_ended(status));
  const std::span<const std::uint8_t> rest = std::span(answer).subspan(1);
  if (answer[0] != static_cast<std::uint8_t>(BuildError::none))
    return failed_build(
        answer[0] == static_cast<std::uint8_t>(BuildError::invalid) ? BuildError::invalid : BuildError::crash,
        std::string(rest.begin(), rest.end()));
  // The levels are decoded and validated as a cache's file is: a child that a groom has taken over can give valid
  // levels only.
  wire::DecodedLevels decoded = wire::decode_levels(rest, hash);
  if (!decoded.levels) return failed_build(BuildError::crash, "its build gave no levels: " + decoded.detail);
  if (!decoded.levels->modes) return failed_build(BuildError::crash, "its build gave no modes");
  BuildPool pool(def.thread_count);
  // The maps between levels are not in the file: they are cheap to make, and large.
  make_level_maps(groom, *decoded.levels, [&pool](std::size_t count, const std::function<void(std::size_t)>& body) {
    pool.parallel_for(count, body);
  });
  return {std::move(decoded.levels), BuildError::none, {}};
}

int run_level_build_process() {
  Request request;
  if (!receive_all(&request, sizeof(request)) || request.magic != kMagic) {
    std::fputs(fmt::format("{} is how hairnet-server starts the builds of its grooms\n", kLevelBuildFlag).c_str(),
               stderr);
    return 2;
  }
  // The limits come before the groom's first byte is read.
  confine(request);
  std::vector<std::uint8_t> file(request.file_bytes);
  if (!receive_all(file.data(), file.size())) return EXIT_FAILURE;
  const Result<Groom> groom = wire::decode_groom(file, request.groom);
  if (!groom) return answer(BuildError::invalid, groom.error());
  if (groom->points.empty()) return answer(BuildError::invalid, std::string("the groom has no strand points"));
  LevelBuildDef def;
  // The child checks neither time nor drops: the parent kills it.
  def.thread_count = request.thread_count;
  def.training = request.training;
  const LevelBuild build = build_levels_in_process(def, request.hash, file, *groom, [] { return BuildError::none; });
  if (!build.levels) return kExitNoMemory;
  return answer(BuildError::none, wire::encode_levels(request.hash, *build.levels));
}

}  // namespace hairnet::server
