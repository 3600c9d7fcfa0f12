#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "core/result.hpp"

namespace hairnet {

// A file under the name that a user gave. The bytes go to a temporary file until finish(). A regular file then appears
// at once, whole, with the permissions of the one that it replaces. What is no regular file gets the bytes then, and
// stays what it is: a device, a pipe, a FIFO, or an open descriptor (/dev/stdout). Symbolic links are followed. Without
// finish(), or when it fails, a regular file stays as it was. Errors do not name the file. One thread.
class OutputFile {
 public:
  // Opens the place and makes the temporary file. It fails when error_of_output() has an answer, or when the system
  // refuses.
  static Result<OutputFile> create(const std::string& path);
  OutputFile(OutputFile&& other) noexcept = default;
  OutputFile& operator=(OutputFile&& other) noexcept = default;
  ~OutputFile() = default;

  // A failure shows in finish().
  void write(std::span<const std::byte> bytes);
  // Later writes replace bytes from the first on, such as a header with counts that are known at the end.
  void go_to_begin();
  // Where another program may write the bytes instead, as ffmpeg does with a video. Its end need not be the same file:
  // what bears the name at finish() counts.
  [[nodiscard]] const std::string& temporary() const { return temporary_.path; }
  // Puts the file under its name. Call it once, last. It reports the first failure of all writes.
  Result<void> finish();

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  // The path of the temporary file, which the destructor removes. An empty path means that there is nothing to remove.
  struct Temporary {
    explicit Temporary(std::string p = {}) : path(std::move(p)) {}
    Temporary(Temporary&& other) noexcept : path(std::exchange(other.path, {})) {}
    Temporary& operator=(Temporary&& other) noexcept {
      std::swap(path, other.path);
      return *this;
    }
    ~Temporary();
    std::string path;
  };
  OutputFile() = default;
  Result<void> copy_to_place();

  // The path of a regular file that finish() replaces; empty when in_place_ is used.
  std::string target_;
  Temporary temporary_;
  // The open temporary file.
  std::unique_ptr<std::FILE, CloseFile> file_;
  // The device, pipe or descriptor to which finish() copies the bytes; null for a regular file.
  std::unique_ptr<std::FILE, CloseFile> in_place_;
  // The errno of the first write that failed.
  int error_ = 0;
};

// Empty, or why no file can be written there; does not name the file.
std::string error_of_output(const std::string& path);

}  // namespace hairnet
