#include "client/assets/import/bvh_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>
#include <optional>

#include "client/assets/import/parse_text.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// `pose` climbs from a joint to its root for each frame. The depth bounds that cost, which a crafted file could
// otherwise make quadratic.
constexpr std::size_t kDepthMax = 256;
// Rates outside of 0.1 to 10 000 Hz are no motion capture, and would make durations and counts of frames absurd.
constexpr double kFrameTimeMin_s = 1e-4, kFrameTimeMax_s = 10;

// Keywords are compared without case, because exporters write CHANNELS and Channels.
bool same_word(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

// After the first error, every function returns false up to `parse`, which returns the error with its line.
class Parser {
 public:
  explicit Parser(std::string_view text) : rest_(text) {}

  Result<BvhFile> parse() {
    if (!same_word(next(), "HIERARCHY")) return Refusal("it does not begin with HIERARCHY: not a BVH file");
    std::string_view word = next();
    while (same_word(word, "ROOT")) {
      if (!joint_tree()) return Refusal(error_);
      word = next();
    }
    if (file_.joints.empty()) return fail("there is no ROOT");
    if (!same_word(word, "MOTION")) return fail("MOTION expected, found '" + shown(word) + "'");
    if (!motion()) return Refusal(error_);
    return std::move(file_);
  }

 private:
  std::string_view next() {
    const std::size_t begin = rest_.find_first_not_of(" \t\r\n\v\f");
    if (begin == std::string_view::npos) {
      rest_ = {};
      return {};
    }
    // Line ends are counted in the blanks between words, so each word costs its length once.
    line_ +=
        static_cast<std::size_t>(std::count(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(begin), '\n'));
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n\v\f"));
    rest_.remove_prefix(word.size());
    return word;
  }

  Refusal fail(const std::string& what) {
    error_ = "line " + std::to_string(line_) + ": " + (rest_.empty() ? "the file ends too early; " : "") + what;
    return Refusal(error_);
  }
  bool refuse(const std::string& what) {
    fail(what);
    return false;
  }

  bool expect(std::string_view word) {
    const std::string_view found = next();
    return same_word(found, word) || refuse(std::string(word) + " expected, found '" + shown(found) + "'");
  }
  template <class Number>
  bool number(Number& out) {
    const std::string_view word = next();
    const auto value = parse_number<Number>(word);
    if (value) out = *value;
    return value || refuse("a number expected, found '" + shown(word) + "'");
  }

  // Reads the whole tree below ROOT. It uses a list instead of recursion, so that deep nesting cannot exhaust the
  // stack. `open` is the path of joints from the root to the one that is read now.
  bool joint_tree() {
    std::vector<int> open;
    if (!open_joint(-1, open)) return false;
    while (!open.empty()) {
      const std::string_view word = next();
      if (same_word(word, "}")) {
        open.pop_back();
      } else if (same_word(word, "JOINT")) {
        if (!open_joint(open.back(), open)) return false;
      } else if (same_word(word, "End")) {
        if (!end_site()) return false;
      } else if (same_word(word, "OFFSET")) {
        Vec3& offset = file_.joints[static_cast<std::size_t>(open.back())].offset;
        for (int a = 0; a < 3; ++a) {
          if (!number(offset[a])) return false;
        }
      } else if (same_word(word, "CHANNELS")) {
        if (!channels(file_.joints[static_cast<std::size_t>(open.back())])) return false;
      } else {
        return refuse("JOINT, End, OFFSET, CHANNELS or } expected, found '" + shown(word) + "'");
      }
    }
    return true;
  }

  bool open_joint(int parent, std::vector<int>& open) {
    if (open.size() >= kDepthMax) return refuse("joints are nested deeper than " + std::to_string(kDepthMax));
    const std::string_view name = next();
    if (name.empty() || name == "{") return refuse("a joint has no name");
    file_.joints.push_back({std::string(name), parent, Vec3::Zero(), {}, 0});
    open.push_back(static_cast<int>(file_.joints.size()) - 1);
    // Some exporters write names of several words, so all words up to the bracket belong to the name.
    std::string_view word = next();
    for (; !word.empty() && word != "{"; word = next()) file_.joints.back().name += ' ' + std::string(word);
    return word == "{" || refuse("{ expected after a joint's name");
  }

  // The end of a limb has no channels and carries no skin, so its offset is checked and dropped.
  bool end_site() {
    double unused = 0;
    return expect("Site") && expect("{") && expect("OFFSET") && number(unused) && number(unused) && number(unused) &&
           expect("}");
  }

  bool channels(BvhFile::Joint& joint) {
    static constexpr std::array<std::string_view, 6> kNames{"Xposition", "Yposition", "Zposition",
                                                            "Xrotation", "Yrotation", "Zrotation"};
    std::uint32_t count = 0;
    if (!number(count)) return false;
    // More than six channels must repeat one. A second list of channels would make the first values belong to nobody.
    if (count > kNames.size() || !joint.channels.empty())
      return refuse("a joint has more than one channel of each kind");
    joint.first_value = file_.values_per_frame;
    for (std::uint32_t c = 0; c < count; ++c) {
      const std::string_view word = next();
      const auto found = std::ranges::find_if(kNames, [&](std::string_view name) { return same_word(name, word); });
      if (found == kNames.end()) return refuse("'" + shown(word) + "' is no channel");
      const auto channel = static_cast<BvhFile::Channel>(found - kNames.begin());
      if (std::ranges::find(joint.channels, channel) != joint.channels.end())
        return refuse("a joint has the channel " + shown(word) + " twice");
      joint.channels.push_back(channel);
    }
    file_.values_per_frame += count;
    return true;
  }

  bool motion() {
    std::uint64_t frame_count = 0;
    if (!expect("Frames:") || !number(frame_count) || !expect("Frame") || !expect("Time:") ||
        !number(file_.frame_time_s))
      return false;
    if (frame_count == 0) return refuse("there are no frames");
    if (file_.values_per_frame == 0) return refuse("no joint has a channel");
    if (!(file_.frame_time_s >= kFrameTimeMin_s && file_.frame_time_s <= kFrameTimeMax_s))
      return refuse("the frame time is not in [0.0001, 10] s");
    // A value takes two characters at least, a digit and a blank. So a false count cannot reserve much memory.
    if (frame_count > rest_.size() / (2 * file_.values_per_frame) + 1)
      return refuse(std::to_string(frame_count) + " frames do not fit into the rest of the file");
    file_.frame_count = frame_count;
    file_.values.resize(frame_count * file_.values_per_frame);
    for (float& value : file_.values) {
      if (!number(value)) return false;
    }
    const std::string_view more = next();
    return more.empty() ||
           refuse("more values than " + std::to_string(frame_count) + " frames have: '" + shown(more) + "'");
  }

  std::string_view rest_;
  std::size_t line_ = 1;
  BvhFile file_;
  std::string error_;
};

// The order of channels in the file is the order of the product, so the last channel turns the point first. Without a
// row, all channels are 0 and the offset holds.
RigidTransform local_transform(const BvhFile::Joint& joint, const float* row) {
  RigidTransform local{Quat::Identity(), joint.offset};
  for (std::size_t c = 0; row && c < joint.channels.size(); ++c) {
    const auto channel = static_cast<int>(joint.channels[c]);
    const double value = row[joint.first_value + c];
    if (channel < 3) {
      local.position[channel] = value;
    } else {
      local.rotation = local.rotation * Eigen::AngleAxisd(value * std::numbers::pi / 180, Vec3::Unit(channel - 3));
    }
  }
  local.rotation.normalize();
  return local;
}

// Climbs to the root, multiplying on the left. The joints' tree was checked, so the loop ends.
RigidTransform to_world(const BvhFile& file, int joint, const float* row) {
  RigidTransform out;
  for (; joint >= 0; joint = file.joints[static_cast<std::size_t>(joint)].parent)
    out = local_transform(file.joints[static_cast<std::size_t>(joint)], row) * out;
  return out;
}

// The whole skeleton at once costs one product a joint; `to_world` for each joint would cost its depth.
std::vector<Vec3> all_positions(const BvhFile& file, const float* row) {
  // Parents come before their children, so every joint is computed once.
  std::vector<RigidTransform> joints;
  std::vector<Vec3> positions;
  for (const BvhFile::Joint& joint : file.joints) {
    const RigidTransform local = local_transform(joint, row);
    joints.push_back(joint.parent < 0 ? local : joints[static_cast<std::size_t>(joint.parent)] * local);
    positions.push_back(joints.back().position);
  }
  return positions;
}

}  // namespace

RigidTransform BvhFile::pose(std::size_t frame, std::size_t joint) const {
  return to_world(*this, static_cast<int>(joint), values.data() + frame * values_per_frame);
}

RigidTransform BvhFile::bind_pose(std::size_t joint) const {
  return to_world(*this, static_cast<int>(joint), nullptr);
}

std::vector<Vec3> BvhFile::positions(std::size_t frame) const {
  return all_positions(*this, values.data() + frame * values_per_frame);
}

std::vector<Vec3> BvhFile::zero_positions() const {
  return all_positions(*this, nullptr);
}

Result<BvhFile> decode_bvh_file(std::string_view text) {
  if (text.find_first_not_of(" \t\r\n\v\f") == std::string_view::npos) return Refusal("the file is empty");
  return Parser(text).parse();
}

}  // namespace hairnet
