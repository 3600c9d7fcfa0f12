#pragma once

#include <unistd.h>

#include <utility>

namespace hairnet::server {

// Owns an open file of the system. It can be neither copied nor moved, and its destructor closes the file.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  explicit operator bool() const { return number_ >= 0; }
  [[nodiscard]] int get() const { return number_; }
  // Only this detects some write errors; returns false for one.
  bool close() { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

}  // namespace hairnet::server
