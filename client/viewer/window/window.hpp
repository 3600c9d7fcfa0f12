#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"

struct GLFWwindow;

namespace hairnet::viewer {

// A window with a current OpenGL ES 3 context, 4 samples a pixel if available, and Dear ImGui over it. There may be one
// at a time, on the program's first thread, as GLFW demands.
class Window {
 public:
  // The error is one line: what is missing, and what works without a window.
  static Result<std::unique_ptr<Window>> open(const std::string& title, int width, int height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // Handles mouse and keyboard events and begins a picture; the window's framebuffer is bound. ImGui may be called
  // until end_picture().
  void begin_picture();
  // Draws ImGui over the picture and shows it. It waits for the display, so it sets the rate of pictures.
  void end_picture();
  [[nodiscard]] bool closing() const;
  // Keys that were pressed since the last picture, as GLFW's numbers, without those that ImGui uses itself.
  [[nodiscard]] const std::vector<int>& keys() const { return keys_; }
  // Returns the size of the framebuffer at begin_picture(), at least 1 x 1.
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }
  // Framebuffer pixels for one mouse point.
  [[nodiscard]] double pixels_per_point() const { return pixels_per_point_; }

 private:
  explicit Window(GLFWwindow* window) : window_(window) {}
  Result<void> start();

  GLFWwindow* window_;
  // Whether Dear ImGui was started, and must be ended.
  bool has_ui_ = false;
  std::vector<int> keys_;
  int width_px_ = 0, height_px_ = 0;
  double pixels_per_point_ = 1;
};

}  // namespace hairnet::viewer
