#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "client/assets/export/byte_writer.hpp"
#include "client/assets/export/formats.hpp"
#include "core/version.hpp"

// glTF 2.0: a mesh of lines for each group. Each frame of a motion after the first is a morph target, which an
// animation of the meshes' weights shows at its time.
namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

// glTF 2 has no sequence of meshes, so each frame is a morph target that is shown alone. The limits are what a viewer
// can take: it has all frames on the GPU, and mixes all of them in each picture.
constexpr std::size_t kBytesMax = std::size_t{512} << 20, kFramesMax = 1000;
// The numbers are those that glTF takes over from OpenGL.
enum Component : unsigned { kUnsigned = 5125, kFloat = 5126 };
enum Target : unsigned { kNone = 0, kVertices = 34962, kIndices = 34963 };
// The mode of a primitive whose indices are pairs of the ends of lines.
constexpr unsigned kLines = 1;

enum class GltfForm : std::uint8_t { json, binary };

// Three bytes become four digits. Digits that are missing in the last group become equals signs.
std::string base64_of(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t b = 0; b < 3; ++b)
      word = word << 8 | (i + b < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + b]) : 0);
    for (std::size_t d = 0; d < 4; ++d) out += i + d > bytes.size() ? '=' : kDigits[word >> (18 - 6 * d) & 63];
  }
  return out;
}

class GltfWriter : public StrandWriter {
 public:
  GltfWriter(GltfForm form, OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion)
      : StrandWriter(strands),
        form_(form),
        file_(std::move(file)),
        motion_(motion),
        frames_(strands.point_count(), kBytesMax) {}

  // Whether a file can have this many frames, by their number and by their bytes.
  [[nodiscard]] Result<void> check(std::size_t frames) const {
    if (frames > kFramesMax)
      return Refusal(std::to_string(frames) + " frames are too many for glTF, of which a viewer mixes all: at most " +
                     std::to_string(kFramesMax) + "; write fewer, or an .abc");
    return frames_.check(frames);
  }

 private:
  Result<void> put(std::span<const Vec3f> points) override {
    if (const Result<void> fits = check(frame_count()); !fits) return fits;
    return frames_.add(points);
  }

  Result<void> close() override {
    json_["asset"] = {{"version", "2.0"}, {"generator", std::string("Hairnet ") + kVersion}};
    // Node 0 is above all groups, so that the hair is one object in other programs.
    json_["scene"] = 0;
    json_["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
    Json children = Json::array();
    for (std::size_t g = 0; g < strands().groups.size(); ++g) children.push_back(g + 1);
    json_["nodes"] = Json::array({{{"name", "hairnet"}, {"children", children}}});
    for (std::size_t g = 0; g < strands().groups.size(); ++g) {
      const std::string name = text_of(strands().groups[g].name);
      json_["nodes"].push_back({{"name", name}, {"mesh", g}, {"extras", {{"groom_group_id", strands().groups[g].id}}}});
      json_["meshes"].push_back({{"name", name}});
    }
    add_lines();
    for (std::size_t f = 0; f < frames_.count(); ++f) add_frame(f);
    if (frames_.count() > 1) add_animation();
    return form_ == GltfForm::binary ? write_binary() : write_json();
  }

  // JSON is UTF-8; a group's name may be anything. Bytes that are no UTF-8 are replaced, where the JSON library would
  // otherwise throw.
  static std::string text_of(const std::string& name) {
    return Json::parse(Json(name).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
  }

  // Appends bytes to the buffer and describes them as a buffer view. Returns the index of the view.
  std::size_t add_view(std::span<const std::byte> bytes, Target target) {
    // The stride is written for vertices, because a view that several accessors share must have it.
    Json view = {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes.size()}};
    if (target != kNone) view["target"] = static_cast<unsigned>(target);
    if (target == kVertices) view["byteStride"] = sizeof(Vec3f);
    data_.put(bytes);
    json_["bufferViews"].push_back(std::move(view));
    return json_["bufferViews"].size() - 1;
  }

  // Describes `count` values of a view, from its byte `at` on. Returns the index of the accessor.
  std::size_t add_accessor(std::size_t view, std::size_t at, Component component, std::size_t count, const char* type) {
    json_["accessors"].push_back({{"bufferView", view},
                                  {"byteOffset", at},
                                  {"componentType", static_cast<unsigned>(component)},
                                  {"count", count},
                                  {"type", type}});
    return json_["accessors"].size() - 1;
  }

  // The indices of each group count from its first point. All groups share one view of positions and one of indices, so
  // a file has few of them for any number of groups.
  void add_lines() {
    std::vector<std::uint32_t> ends;
    std::vector<std::size_t> first;
    for (const ExportedStrands::Group& group : strands().groups) {
      first.push_back(ends.size());
      for (std::uint32_t s = group.begin; s < group.end; ++s) {
        for (std::uint32_t i = strands().strand_begin[s]; i + 1 < strands().strand_begin[s + 1]; ++i)
          ends.insert(ends.end(), {i - group.first_point, i - group.first_point + 1});
      }
    }
    first.push_back(ends.size());
    const std::size_t view = add_view(std::as_bytes(std::span(ends)), kIndices);
    for (std::size_t g = 0; g + 1 < first.size(); ++g) {
      const std::size_t indices =
          add_accessor(view, first[g] * sizeof(std::uint32_t), kUnsigned, first[g + 1] - first[g], "SCALAR");
      json_["meshes"][g]["primitives"] =
          Json::array({{{"attributes", Json::object()}, {"indices", indices}, {"mode", kLines}}});
    }
  }

  // Adds the positions of the first frame, which are the mesh. Each other frame is a target: its differences to the
  // mesh, which glTF adds with the target's weight.
  void add_frame(std::size_t frame) {
    std::vector<Vec3f> points(frames_.frame(frame).begin(), frames_.frame(frame).end());
    for (std::size_t i = 0; frame > 0 && i < points.size(); ++i) points[i] -= frames_.frame(0)[i];
    const std::size_t view = add_view(std::as_bytes(std::span(points)), kVertices);
    // glTF demands the smallest and largest position of each accessor.
    for (std::size_t g = 0; g < strands().groups.size(); ++g) {
      const ExportedStrands::Group& group = strands().groups[g];
      Vec3f low = points[group.first_point], high = low;
      for (std::size_t i = group.first_point; i < group.end_point; ++i) {
        low = low.cwiseMin(points[i]);
        high = high.cwiseMax(points[i]);
      }
      const std::size_t accessor =
          add_accessor(view, group.first_point * sizeof(Vec3f), kFloat, group.point_count(), "VEC3");
      json_["accessors"][accessor]["min"] = {low[0], low[1], low[2]};
      json_["accessors"][accessor]["max"] = {high[0], high[1], high[2]};
      Json& primitive = json_["meshes"][g]["primitives"][0];
      if (frame == 0) {
        primitive["attributes"]["POSITION"] = accessor;
      } else {
        primitive["targets"].push_back({{"POSITION", accessor}});
      }
    }
  }

  // At frame f the weight of target f is 1 and all others are 0, and linear interpolation between frames mixes two
  // neighbours.
  void add_animation() {
    const std::size_t count = frames_.count(), targets = count - 1;
    // The weights have a square of the number of frames, which is one reason for the limit of 1000.
    std::vector<float> times, weights(count * targets, 0);
    for (std::size_t f = 0; f < count; ++f) {
      times.push_back(static_cast<float>(static_cast<double>(f) / motion_->rate_hz));
      if (f > 0) weights[f * targets + f - 1] = 1;
    }
    const std::size_t input =
        add_accessor(add_view(std::as_bytes(std::span(times)), kNone), 0, kFloat, count, "SCALAR");
    const std::size_t output =
        add_accessor(add_view(std::as_bytes(std::span(weights)), kNone), 0, kFloat, weights.size(), "SCALAR");
    json_["accessors"][input]["min"] = Json::array({times.front()});
    json_["accessors"][input]["max"] = Json::array({times.back()});
    Json channels = Json::array();
    for (std::size_t g = 0; g < strands().groups.size(); ++g) {
      json_["meshes"][g]["weights"] = std::vector<int>(targets, 0);
      channels.push_back({{"sampler", 0}, {"target", {{"node", g + 1}, {"path", "weights"}}}});
    }
    Json sampler = {{"input", input}, {"output", output}, {"interpolation", "LINEAR"}};
    json_["animations"] =
        Json::array({{{"name", "motion"}, {"samplers", Json::array({std::move(sampler)})}, {"channels", channels}}});
  }

  Result<void> write_json() {
    json_["buffers"] = Json::array(
        {{{"uri", "data:application/octet-stream;base64," + base64_of(data_.bytes())}, {"byteLength", data_.size()}}});
    const std::string text = json_.dump();
    file_.write(std::as_bytes(std::span(text)));
    return file_.finish();
  }

  // A .glb has a JSON chunk, filled up with blanks, and one of bytes. All sizes are of 32 bits.
  Result<void> write_binary() {
    json_["buffers"] = Json::array({{{"byteLength", data_.size()}}});
    ByteWriter text, head;
    text.text(json_.dump()).align(4, ' ');
    constexpr std::size_t kHeaderBytes = 12, kChunkBytes = 8;
    const std::size_t bytes = kHeaderBytes + 2 * kChunkBytes + text.size() + data_.size();
    if (bytes > std::numeric_limits<std::uint32_t>::max()) return Refusal("more than the 4 GB of a .glb");
    head.text("glTF").put(2U).put(static_cast<std::uint32_t>(bytes));
    head.put(static_cast<std::uint32_t>(text.size())).text("JSON").put(text.bytes());
    head.put(static_cast<std::uint32_t>(data_.size())).text(std::string_view("BIN\0", 4));
    file_.write(head.bytes());
    file_.write(data_.bytes());
    return file_.finish();
  }

  GltfForm form_;
  OutputFile file_;
  MaybeMotion motion_;
  KeptFrames frames_;
  Json json_;
  // All numbers have 4 bytes, so that each list begins where it must.
  ByteWriter data_;
};

// The number of frames is checked before anything is simulated, where it is known.
OpenedWriter open_gltf(GltfForm form, OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion) {
  auto writer = std::make_unique<GltfWriter>(form, std::move(file), strands, motion);
  const std::size_t frames = motion ? motion->frame_count.value_or(1) : 1;
  if (const Result<void> fits = writer->check(frames); !fits) return Refusal(fits.error());
  return writer;
}

}  // namespace

OpenedWriter write_gltf(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion) {
  return open_gltf(GltfForm::json, std::move(file), strands, motion);
}

OpenedWriter write_glb(OutputFile file, const ExportedStrands& strands, const MaybeMotion& motion) {
  return open_gltf(GltfForm::binary, std::move(file), strands, motion);
}

}  // namespace hairnet
