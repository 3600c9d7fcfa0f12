#include "client/viewer/window/window.hpp"

#define GLFW_INCLUDE_NONE
#include <GLES3/gl3.h>
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <array>

namespace hairnet::viewer {
namespace {

// GLFW reports errors through a function without a user argument, so the last one is kept here.
std::string g_error;

void on_error(int, const char* description) {
  g_error = description;
}

// The keys that went down since the last picture. ImGui of this version sees only keys that are down at a picture, and
// with slow pictures would miss key presses.
std::vector<int> g_pressed;

void on_key(GLFWwindow*, int key, int, int action, int modifiers) {
  // The list is bounded, however many keys come while no picture is drawn.
  constexpr std::size_t kMax = 64;
  if (action == GLFW_PRESS && (modifiers & (GLFW_MOD_CONTROL | GLFW_MOD_ALT)) == 0 && g_pressed.size() < kMax)
    g_pressed.push_back(key);
}

constexpr const char* kInstead =
    "; without one, --out PICTURE.png or --out CLIP.mp4 draws off-screen (with --local too), --no-draw streams only";

// Hints are GLFW's global state: they are set from the defaults for each try.
GLFWwindow* create(const std::string& title, int width, int height, int context_api, int samples) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CLIENT_API, GLFW_OPENGL_ES_API);
  glfwWindowHint(GLFW_CONTEXT_CREATION_API, context_api);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
  glfwWindowHint(GLFW_SAMPLES, samples);
  glfwWindowHint(GLFW_DEPTH_BITS, 24);
  return glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
}

}  // namespace

Result<std::unique_ptr<Window>> Window::open(const std::string& title, int width, int height) {
  glfwSetErrorCallback(on_error);
  if (glfwInit() != GLFW_TRUE) return Refusal("no window: no display (" + g_error + ")" + kInstead);
  GLFWwindow* made = nullptr;
  // EGL is what OpenGL ES needs on most systems, the native interface on some. Fewer samples are better than no window.
  for (const int context_api : {GLFW_EGL_CONTEXT_API, GLFW_NATIVE_CONTEXT_API}) {
    for (const int samples : {4, 0}) {
      if (made == nullptr) made = create(title, width, height, context_api, samples);
    }
  }
  if (made == nullptr) {
    glfwTerminate();
    return Refusal("no window: no OpenGL ES 3 on this display (" + g_error + ")" + kInstead);
  }
  std::unique_ptr<Window> window(new Window(made));
  if (const Result<void> started = window->start(); !started) return Refusal(started.error());
  return window;
}

Result<void> Window::start() {
  glfwMakeContextCurrent(window_);
  // Wait for the display, so that a fast machine does not draw pictures that nobody sees.
  glfwSwapInterval(1);
  glfwSetWindowSizeLimits(window_, 320, 240, GLFW_DONT_CARE, GLFW_DONT_CARE);
  g_pressed.clear();
  // This must come before ImGui sets its own callback, which then calls this one.
  glfwSetKeyCallback(window_, on_key);
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  // Without a name ImGui writes no file of its settings.
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::StyleColorsDark();
  ImGui::GetStyle().Colors[ImGuiCol_WindowBg].w = 0.82f;
  ImGui::GetStyle().WindowRounding = 4;
  has_ui_ = true;
  if (!ImGui_ImplGlfw_InitForOpenGL(window_, true) || !ImGui_ImplOpenGL3_Init("#version 300 es"))
    return Refusal("no window: its controls cannot be drawn");
  // Dense displays need larger letters and gaps.
  float scale = 1;
  glfwGetWindowContentScale(window_, &scale, nullptr);
  if (scale > 1) {
    ImGui::GetStyle().ScaleAllSizes(scale);
    ImGui::GetIO().FontGlobalScale = scale;
  }
  return {};
}

Window::~Window() {
  if (has_ui_) {
    // ImGui's parts are ended only if they were begun: start() may have failed between them.
    if (ImGui::GetIO().BackendRendererUserData != nullptr) ImGui_ImplOpenGL3_Shutdown();
    if (ImGui::GetIO().BackendPlatformUserData != nullptr) ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
  glfwDestroyWindow(window_);
  glfwTerminate();
}

bool Window::closing() const {
  return glfwWindowShouldClose(window_) == GLFW_TRUE;
}

void Window::begin_picture() {
  glfwPollEvents();
  keys_.clear();
  // Keys that go into a text field are not commands.
  if (!ImGui::GetIO().WantTextInput) keys_ = g_pressed;
  g_pressed.clear();
  glfwGetFramebufferSize(window_, &width_px_, &height_px_);
  // A minimized window has no size, and a picture needs one.
  width_px_ = std::max(width_px_, 1);
  height_px_ = std::max(height_px_, 1);
  std::array<int, 2> size{};
  glfwGetWindowSize(window_, &size[0], &size[1]);
  // Mouse positions are in the window's points, which dense displays draw with several pixels.
  pixels_per_point_ = static_cast<double>(height_px_) / std::max(1, size[1]);
  // Other code, such as a Picture, may have left another framebuffer bound.
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void Window::end_picture() {
  ImGui::Render();
  glViewport(0, 0, width_px_, height_px_);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
}

}  // namespace hairnet::viewer
