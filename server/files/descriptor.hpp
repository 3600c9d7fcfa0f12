#pragma once

#include <unistd.h>

#include <utility>

namespace hairnet::server {

// Owns an open file of the system; a negative number stands for none. It can be neither copied nor moved, and its
// destructor closes the file.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  explicit operator bool() const { return number_ >= 0; }
  [[nodiscard]] int get() const { return number_; }
  // Closes the file. Only this call detects some write errors; returns false for one.
  bool close() { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }
  // Closes the file, and owns this one instead.
  void reset(int number) {
    close();
    number_ = number;
  }
  // Gives the file up: the caller closes it.
  [[nodiscard]] int release() { return std::exchange(number_, -1); }

 private:
  int number_;
};

}  // namespace hairnet::server
