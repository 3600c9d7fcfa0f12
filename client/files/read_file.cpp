#include "client/files/read_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "schema/files/system_refusal.hpp"

namespace hairnet {
namespace {

// Owns an open file of the system.
class Descriptor {
 public:
  explicit Descriptor(const std::string& path) : number_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  [[nodiscard]] int number() const { return number_; }

 private:
  int number_;
};

}  // namespace

Result<std::vector<std::byte>> read_file(const std::string& path, std::size_t bytes_max) {
  // Opened without waiting, then checked: opening a pipe without a writer would block.
  const Descriptor file(path);
  struct stat status {};
  if (file.number() < 0 || ::fstat(file.number(), &status) != 0) return system_refusal("cannot be opened");
  if (S_ISDIR(status.st_mode)) return Refusal("is a directory, not a file");
  if (!S_ISREG(status.st_mode)) return Refusal("is a pipe or device, not a file");

  // Reads in growing pieces, because the file may change after its size was read.
  std::vector<std::byte> bytes;
  // Pieces grow from 64 KB to 16 MB: a small file takes little memory, and a large one few reads.
  std::size_t piece = std::size_t{1} << 16;
  while (true) {
    const std::size_t before = bytes.size();
    // One byte more than the limit tells a file that is too large from one that just fits.
    bytes.resize(before + std::min(piece, bytes_max + 1 - before));
    const ssize_t got = ::read(file.number(), bytes.data() + before, bytes.size() - before);
    // A signal may end a read early; the loop then reads again.
    const bool interrupted = got < 0 && errno == EINTR;
    if (got < 0 && !interrupted) return system_refusal("cannot be read");
    bytes.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (bytes.size() > bytes_max) return Refusal("is larger than the limit of " + std::to_string(bytes_max) + " bytes");
    if (got == 0) break;
    piece = std::min(piece * 2, std::size_t{1} << 24);
  }
  if (bytes.empty()) return Refusal("is empty");
  return bytes;
}

}  // namespace hairnet
