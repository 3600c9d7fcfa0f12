#include "client/assets/import/imported_body.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <random>
#include <string>

#include "client/assets/import/guess_placement.hpp"
#include "client/assets/import/hair_import.hpp"
#include "client/assets/import/obj.hpp"
#include "client/assets/import/skull_fit.hpp"
#include "client/assets/made/made.hpp"
#include "tests/support/import_files.hpp"

namespace hairnet {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using Triangle = std::array<std::uint32_t, 3>;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::string text_of(std::vector<std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Makes a binary glTF file (.glb) of JSON, in which ' stands for ", and of a buffer. The numbers are the words glTF,
// JSON and BIN, and the header with both chunk headers takes 28 bytes.
std::string glb(std::string json, const std::string& buffer) {
  for (char& c : json) c = c == '\'' ? '"' : c;
  json.resize((json.size() + 3) / 4 * 4, ' ');
  test::Bytes head;
  head.u32(0x46546c67).u32(2).u32(static_cast<std::uint32_t>(28 + json.size() + buffer.size()));
  head.u32(static_cast<std::uint32_t>(json.size())).u32(0x4e4f534a);
  test::Bytes between;
  between.u32(static_cast<std::uint32_t>(buffer.size())).u32(0x004e4942);
  return text_of(head.take()) + json + text_of(between.take()) + buffer;
}

const std::string kAsset = "'asset': {'version': '2.0'}";

// A square of four vertices in the plane z = 0, and two triangles of it.
std::string square_buffer() {
  test::Bytes out;
  for (const float x : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f}) out.f32(x);
  for (const int i : {0, 1, 2, 0, 2, 3}) out.u16(static_cast<std::uint16_t>(i));
  return text_of(out.take());
}

// The component types are those of glTF: 5126 is float, 5123 is uint16; 5122 below is int16. The buffer has 48 bytes of
// positions and 12 of indices.
const std::string kSquareViews =
    "'buffers': [{'byteLength': 60}], 'bufferViews': [{'buffer': 0, 'byteLength': 48}, {'buffer': 0, 'byteOffset': 48, "
    "'byteLength': 12}], 'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 4, 'type': 'VEC3'}, "
    "{'bufferView': 1, 'componentType': 5123, 'count': 6, 'type': 'SCALAR'}]";

std::string square_mesh(const std::string& more = "") {
  return "'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1" + more + "}]}]";
}

// Makes a file of the square, with these nodes. `more` is further JSON.
std::string square_file(const std::string& nodes, const std::string& more = "") {
  return glb("{" + kAsset + ", 'nodes': [" + nodes + "], " + square_mesh() + ", " + kSquareViews + more + "}",
             square_buffer());
}

ImportedBody body_of(const std::string& file, const ReadBeside& beside = {}) {
  Result<ImportedBody> body = decode_gltf_body(bytes_of(file), beside);
  EXPECT_TRUE(body) << body.error();
  return body ? std::move(*body) : ImportedBody{};
}

std::string refusal(const std::string& file) {
  const Result<ImportedBody> body = decode_gltf_body(bytes_of(file));
  return body ? std::string() : body.error();
}

void expect_near(const Vec3f& got, const Vec3f& expected) {
  EXPECT_LT((got - expected).norm(), 1e-5f) << got.transpose() << " for " << expected.transpose();
}

void expect_valid(const TriangleMesh& mesh) {
  for (const Vec3f& x : mesh.vertices) ASSERT_TRUE(x.allFinite());
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh.vertices.size());
  }
}

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(BodyJoints, usual_names_are_known) {
  for (const char* name :
       {"Head", "head", "mixamorig:Head", "mixamorig1:Head", "mixamorigHead", "J_Bip_C_Head", "Bip01 Head",
        "Bip001_Head", "CC_Base_Head", "DEF-head", "head_Armature", "head_JNT", "ValveBiped.Bip01_Head1", "b_head"})
    EXPECT_EQ(bone_of_joint(name), Bone::head) << name;
  for (const char* name : {"Neck", "neck_01", "mixamorig:Neck", "J_Bip_C_Neck", "Bip01 Neck"})
    EXPECT_EQ(bone_of_joint(name), Bone::neck) << name;
  for (const char* name : {"LeftShoulder", "mixamorig:LeftShoulder", "shoulder.L", "Shoulder_L", "clavicle_l",
                           "J_Bip_L_Shoulder", "Bip01 L Clavicle", "CC_Base_L_Clavicle", "lCollar", "leftShoulder"})
    EXPECT_EQ(bone_of_joint(name), Bone::left_shoulder) << name;
  EXPECT_EQ(bone_of_joint("RightShoulder"), Bone::right_shoulder);
  // These names are of ends, of other bones, of an unknown side, or of hair.
  for (const char* name : {"", "HeadTop_End", "head_end", "HeadNub", "headset", "LeftArm", "shoulder", "Neck Twist",
                           "mixamorig:LeftHand", "hair_head_01_a", "\xff\x01", "l"})
    EXPECT_EQ(bone_of_joint(name), std::nullopt) << name;
}

TEST(ImportGltf, a_mesh_lies_where_the_nodes_above_it_put_it) {
  const ImportedBody body =
      body_of(square_file("{'children': [1], 'translation': [1, 2, 3], 'rotation': [0, 0.70710678, 0, 0.70710678], "
                          "'scale': [2, 2, 2]}, {'mesh': 0, 'translation': [0, 0, 1]}"));
  ASSERT_EQ(body.mesh.vertices.size(), 4u);
  // The inner node shifts by (0, 0, 1). The outer one scales by 2, turns by 90 degrees about y (+z to +x), and shifts.
  expect_near(body.mesh.vertices[0], {3, 2, 3});
  expect_near(body.mesh.vertices[1], {3, 2, 1});
  expect_near(body.mesh.vertices[3], {3, 4, 3});
  EXPECT_THAT(body.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_EQ(body.states.up, Axis::plus_y);
  EXPECT_EQ(body.states.face, Axis::plus_z);
  EXPECT_EQ(body.states.unit_m, 1);
  EXPECT_FALSE(body.states.origin);
}

TEST(ImportGltf, a_matrix_is_written_by_columns_and_a_mirrored_mesh_keeps_its_outside) {
  const ImportedBody body = body_of(square_file("{'mesh': 0, 'matrix': [-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]}"));
  expect_near(body.mesh.vertices[1], {4, 0, 0});
  EXPECT_THAT(body.mesh.triangles, ElementsAre(Triangle{0, 2, 1}, Triangle{0, 3, 2}));
}

TEST(ImportGltf, all_nodes_of_the_scene_are_one_mesh_and_others_are_left_out) {
  const std::string nodes = "{'mesh': 0}, {'mesh': 0, 'translation': [9, 0, 0]}, {'mesh': 0}";
  const ImportedBody body = body_of(square_file(nodes, ", 'scene': 1, 'scenes': [{}, {'nodes': [1, 2]}]"));
  ASSERT_EQ(body.mesh.vertices.size(), 8u);
  EXPECT_EQ(body.mesh.vertices[0].x() + body.mesh.vertices[4].x(), 9);
  EXPECT_EQ(body.mesh.triangles[2], (Triangle{4, 5, 6}));
  EXPECT_EQ(body_of(square_file(nodes)).mesh.vertices.size(), 12u) << "without a scene all nodes are shown";
}

TEST(ImportGltf, strips_and_fans_are_triangles_and_lines_are_told) {
  const auto as_mode = [](int mode) {
    return glb("{" + kAsset +
                   ", 'nodes': [{'mesh': 0}], 'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, "
                   "'mode': " +
                   std::to_string(mode) + "}, {'mode': 1}]}], " + kSquareViews + "}",
               square_buffer());
  };
  // In glTF the mode 5 is a strip of triangles, 6 a fan, and 1 lines.
  const ImportedBody strip = body_of(as_mode(5));
  EXPECT_THAT(strip.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{1, 3, 2}));
  EXPECT_THAT(strip.notes, ElementsAre("1 part of points or lines left out"));
  EXPECT_THAT(body_of(as_mode(6)).mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_THAT(refusal(as_mode(1)), HasSubstr("no triangles"));
}

// Makes a square with a skin. Vertices 0 and 1 follow the joint "root"; vertices 2 and 3 follow "root" by half, and
// "mixamorig:Head" by half. The skin names five joints but has matrices for two, which tests correct.
std::string skinned_file() {
  test::Bytes out;
  // These are four joints and four weights for each vertex, and then the two inverse bind matrices. The second one
  // shifts by -1 along y.
  for (std::uint32_t v = 0; v < 4; ++v) out.u16(0).u16(1).u16(0).u16(0);
  for (std::uint32_t v = 0; v < 4; ++v) out.f32(v < 2 ? 1 : 0.5f).f32(v < 2 ? 0 : 0.5f).f32(0).f32(0);
  for (const float y : {0.0f, -1.0f}) {
    for (int i = 0; i < 16; ++i) out.f32(i % 5 == 0 ? 1 : i == 13 ? y : 0);
  }
  const std::string more =
      "{'buffer': 0, 'byteOffset': 60, 'byteLength': 32}, {'buffer': 0, 'byteOffset': 92, 'byteLength': 64}, "
      "{'buffer': 0, 'byteOffset': 156, 'byteLength': 128}], 'accessors': [";
  std::string views = changed(kSquareViews, "], 'accessors': [", ", " + more);
  views.insert(views.size() - 1,
               ", {'bufferView': 2, 'componentType': 5123, 'count': 4, 'type': 'VEC4'}, {'bufferView': 3, "
               "'componentType': 5126, 'count': 4, 'type': 'VEC4'}, {'bufferView': 4, 'componentType': 5126, 'count': "
               "2, 'type': 'MAT4'}");
  views = changed(views, "'byteLength': 60", "'byteLength': 284");
  return glb(
      "{" + kAsset +
          ", 'nodes': [{'name': 'root', 'children': [1, 3, 4]}, {'name': 'mixamorig:Head', 'translation': [0, 3, "
          "0], 'children': [5]}, {'mesh': 0, 'skin': 0, 'translation': [100, 0, 0]}, {'name': 'LeftShoulder', "
          "'translation': [0, 1, -0.1]}, {'name': 'RightShoulder', 'translation': [0, 1, 0.1]}, {'name': "
          "'Head', 'translation': [0, 1, 0]}], 'skins': [{'joints': [0, 1, 3, 4, 5], 'inverseBindMatrices': "
          "4}], " +
          changed(square_mesh(), "'POSITION': 0", "'POSITION': 0, 'JOINTS_0': 2, 'WEIGHTS_0': 3") + ", " + views + "}",
      square_buffer() + text_of(out.take()));
}

TEST(ImportGltf, a_skin_follows_its_joints_and_not_its_node) {
  std::string file = skinned_file();
  EXPECT_THAT(refusal(file), HasSubstr("fewer matrices than joints"));
  file = changed(file, "[0, 1, 3, 4, 5], \"inv", "[0, 1         ], \"inv");
  const ImportedBody body = body_of(file);
  ASSERT_EQ(body.mesh.vertices.size(), 4u);
  expect_near(body.mesh.vertices[1], {1, 0, 0});
  // The root leaves vertex 2 at (1, 1, 0). The head joint, at y = 3 and bound at y = 1, moves it to (1, 3, 0); this is
  // halfway.
  expect_near(body.mesh.vertices[2], {1, 2, 0});
  ASSERT_TRUE(body.states.origin);
  EXPECT_EQ(*body.states.origin, Vec3(0, 3, 0));
  EXPECT_EQ(body.joints[0]->name, "mixamorig:Head");
}

TEST(ImportGltf, joints_tell_head_and_face) {
  std::string file = changed(skinned_file(), "\"inverseBindMatrices\": 4", "\"name\":      \"body\"     ");
  const ImportedBody body = body_of(file);
  EXPECT_EQ(body.states.face, Axis::plus_x) << "the left shoulder is at -z";
  EXPECT_EQ(body.states.origin, Vec3(0, 3, 0)) << "a joint above comes before one below";
  ASSERT_TRUE(body.joints[static_cast<std::size_t>(Bone::left_shoulder)]);
}

// The joint has a German name, which no list of usual names has, so only the avatar's own list finds it.
TEST(ImportGltf, an_avatar_lists_its_bones_itself) {
  const std::string nodes = "{'mesh': 0}, {'name': 'Kopf', 'translation': [0, 1.4, 0]}";
  const ImportedBody older = body_of(
      square_file(nodes,
                  ", 'extensions': {'VRM': {'humanoid': {'humanBones': [{'bone': 'hips', 'node': 0}, {'bone': 'head', "
                  "'node': 1}]}}}"));
  ASSERT_TRUE(older.states.origin);
  EXPECT_EQ(older.joints[0]->name, "Kopf");
  EXPECT_EQ(older.states.face, Axis::minus_z) << "VRM 0 looks along -z";
  const ImportedBody newer =
      body_of(square_file(nodes, ", 'extensions': {'VRMC_vrm': {'humanoid': {'humanBones': {'head': {'node': 1}}}}}"));
  EXPECT_EQ(newer.states.origin, Vec3(0, 1.4, 0));
  EXPECT_EQ(newer.states.face, Axis::plus_z);
}

TEST(ImportGltf, numbers_may_be_small_and_rows_apart) {
  test::Bytes out;
  // As normalized int16 numbers, 32767 is 1 and 32769 is -1. Rows are 12 bytes apart, of which 6 are used.
  for (int v = 0; v < 3; ++v) out.u16(v > 0 ? 32767 : 0).u16(v > 1 ? 32769 : 0).u16(0).zeros(6);
  const std::string views =
      "'buffers': [{'byteLength': 36}], 'bufferViews': [{'buffer': 0, 'byteLength': 36, 'byteStride': 12}], "
      "'accessors': [{'bufferView': 0, 'componentType': 5122, 'count': 3, 'type': 'VEC3', 'normalized': true}]";
  const ImportedBody body = body_of(glb("{" + kAsset +
                                            ", 'nodes': [{'mesh': 0}], 'meshes': [{'primitives': "
                                            "[{'attributes': {'POSITION': 0}}]}], " +
                                            views + "}",
                                        text_of(out.take())));
  ASSERT_EQ(body.mesh.vertices.size(), 3u);
  expect_near(body.mesh.vertices[2], {1, -1, 0});
  EXPECT_EQ(body.mesh.triangles.size(), 1u);
}

TEST(ImportGltf, buffers_may_be_in_the_text_or_beside_it) {
  const auto text = [](const std::string& uri) {
    std::string json = "{" + kAsset + ", 'nodes': [{'mesh': 0}], " + square_mesh() + ", " +
                       changed(kSquareViews, "'byteLength': 60", "'byteLength': 60, 'uri': '" + uri + "'") + "}";
    for (char& c : json) c = c == '\'' ? '"' : c;
    return json;
  };
  std::string asked;
  const ImportedBody beside = body_of(text("my%20body.bin"), [&](const std::string& name) {
    asked = name;
    const std::string buffer = square_buffer();
    const auto bytes = bytes_of(buffer);
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  });
  EXPECT_EQ(asked, "my body.bin");
  expect_near(beside.mesh.vertices[2], {1, 1, 0});
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string base64;
  const std::string buffer = square_buffer();
  for (std::size_t i = 0; i < buffer.size(); i += 3) {
    const auto at = [&](std::size_t k) { return static_cast<unsigned char>(buffer[i + k]); };
    const unsigned bits = at(0) << 16 | at(1) << 8 | at(2);
    for (unsigned shift = 24; shift > 0; shift -= 6) base64.push_back(kDigits[bits >> (shift - 6) & 63]);
  }
  EXPECT_EQ(body_of(text("data:application/octet-stream;base64," + base64)).mesh.triangles.size(), 2u);
  // A file from a stranger must not read files outside its own folder.
  for (const char* uri : {"/etc/passwd", "../x.bin", "a/%2e%2e/x.bin", "http://x/y.bin", "%00"}) {
    const auto never = [](const std::string& name) -> Result<std::vector<std::byte>> {
      ADD_FAILURE() << "asked for " << name;
      return Refusal("no");
    };
    EXPECT_FALSE(decode_gltf_body(bytes_of(text(uri)), never)) << uri;
  }
  EXPECT_THAT(refusal(text("body.bin")), HasSubstr("export it as .glb"));
}

TEST(ImportGltf, bad_files_are_refused_with_a_reason) {
  const std::string file = square_file("{'mesh': 0, 'name': 'skin'}, {'children': [0]}");
  struct Bad {
    std::string from, to, reason;
  };
  for (const Bad& bad : {Bad{R"("version": "2.0")", R"("version": "1.0")", "glTF of version 1.0"},
                         {R"("children": [0])", R"("children": [1])", "hangs on itself"},
                         {R"("children": [0])", R"("children": [7])", "a child that does not exist"},
                         {R"("mesh": 0)", R"("mesh": 1)", "node 0 skin has a mesh that does not exist"},
                         {R"("mesh": 0)", R"("mush": 0)", "no triangles"},
                         {R"("count": 4)", R"("count": 5)", "truncated: accessor 0 has 5 rows"},
                         {R"("count": 4)", R"("count": 3)", "a vertex that does not exist"},
                         {R"("count": 4)", R"("count":-1)", "truncated"},
                         {R"("byteOffset": 48)", R"("byteOffset": 49)", "truncated"},
                         {R"("componentType": 5126)", R"("componentType": 5124)", "does not have 3 numbers"},
                         {R"("VEC3")", R"("VEC2")", "does not have 3 numbers"},
                         {R"("POSITION": 0)", R"("POSITIOM": 0)", "no positions"},
                         {R"("POSITION": 0)", R"("POSITION": 9)", "there is no accessor 9"},
                         {R"("bufferView": 0)", R"("bufferVjew": 0)", "sparse"},
                         {R"("buffer": 0)", R"("buffer": 1)", "there is no buffer 1"},
                         {R"("asset")", R"("asset})", "damaged"},
                         {"glTF", "glTE", "not a glTF file"}}) {
    const std::string reason = refusal(changed(file, bad.from, bad.to));
    EXPECT_THAT(reason, HasSubstr(bad.reason)) << bad.from;
    EXPECT_EQ(reason.find('\n'), std::string::npos);
  }
  std::string nan = file;
  // The last 60 bytes are the buffer, so its first coordinate becomes a NaN.
  nan.replace(nan.size() - 60, 4, std::string("\0\0\xc0\x7f", 4));
  EXPECT_THAT(refusal(nan), HasSubstr("not finite"));
  EXPECT_THAT(refusal(square_file("{'mesh': 0}, {'children': [0]}, {'children': [0]}")), HasSubstr("two nodes"));
}

TEST(ImportGltf, small_files_that_ask_for_much_are_refused) {
  std::string nodes = "{'mesh': 0}";
  // A mesh may be used by kPrimitivesMax, 10 000, nodes (gltf_body.cpp). JSON may be nested 64 deep and have 500 000
  // values (gltf_file.cpp). A small file must not cost much memory or time.
  for (int i = 0; i < 200'000; ++i) nodes += ",{'mesh':0}";
  EXPECT_THAT(refusal(square_file(nodes)), HasSubstr("join them"));
  const auto with_json = [](const std::string& more) {
    return refusal(glb("{" + kAsset + ", 'x': " + more + "}", ""));
  };
  EXPECT_THAT(with_json(std::string(100'000, '[') + std::string(100'000, ']')), HasSubstr("nested"));
  std::string many = "[0";
  for (int i = 0; i < 600'000; ++i) many += ",0";
  EXPECT_THAT(with_json(many + "]"), HasSubstr("values"));
  const auto packed = [](const std::string& packing) {
    const std::string from = "{'buffer': 0, 'byteLength': 48}";
    return refusal(glb("{" + kAsset + ", 'nodes': [{'mesh': 0}], " + square_mesh() + ", " +
                           changed(kSquareViews, from,
                                   "{'buffer': 0, 'byteLength': 48, 'extensions': {'EXT_meshopt_compression': "
                                   "{'buffer': 0, 'byteLength': 48, " +
                                       packing + "}}}") +
                           "}",
                       square_buffer()));
  };
  EXPECT_THAT(packed("'byteStride': 12, 'count': 4000000000, 'mode': 'ATTRIBUTES'"), HasSubstr("than its bytes can"));
  EXPECT_THAT(packed("'byteStride': 12, 'count': 4, 'mode': 'ATTRIBUTES'"), HasSubstr("damaged"));
  EXPECT_THAT(packed("'byteStride': 13, 'count': 4, 'mode': 'ATTRIBUTES'"), HasSubstr("not known"));
  EXPECT_THAT(packed("'byteStride': 4, 'count': 4, 'mode': 'TRIANGLES'"), HasSubstr("not known"));
}

// Reads every beginning of a file, and 20 000 copies in which one to three bytes differ. Each must be a valid mesh or
// be refused in one line. Half of the changed digits stay digits, so that many copies are still well-formed.
void expect_valid_or_refused(const std::string& file,
                             const std::function<Result<TriangleMesh>(const std::string&)>& read) {
  const auto check = [&](const std::string& bytes) {
    const Result<TriangleMesh> mesh = read(bytes);
    if (mesh) return expect_valid(*mesh);
    EXPECT_NE(mesh.error(), "");
    EXPECT_EQ(mesh.error().find('\n'), std::string::npos) << mesh.error();
  };
  for (std::size_t length = 0; length < file.size(); ++length) check(file.substr(0, length));
  std::mt19937 random(7);
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes = file;
    for (auto n = 1 + random() % 3; n > 0; --n) {
      char& c = bytes[random() % bytes.size()];
      c = c >= '0' && c <= '9' && random() % 2 == 0 ? static_cast<char>('0' + random() % 10)
                                                    : static_cast<char>(random());
    }
    check(bytes);
  }
}

Result<TriangleMesh> mesh_of(Result<ImportedBody> body) {
  if (!body) return Refusal(body.error());
  return std::move(body->mesh);
}

TEST(ImportGltf, every_truncation_and_20000_mutations_are_valid_or_refused) {
  // The file has as many joints as matrices, so that it is read.
  const std::string file = changed(skinned_file(), "[0, 1, 3, 4, 5], \"inv", "[0, 1         ], \"inv");
  for (std::size_t length = 0; length < file.size(); ++length)
    EXPECT_FALSE(decode_gltf_body(bytes_of(file.substr(0, length)))) << length;
  expect_valid_or_refused(file, [](const std::string& bytes) { return mesh_of(decode_gltf_body(bytes_of(bytes))); });
}

const std::string kPlySquare =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face "
    "1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

TEST(ImportPlyMesh, polygons_become_fans) {
  const auto mesh = decode_ply_mesh(bytes_of(kPlySquare));
  ASSERT_TRUE(mesh) << mesh.error();
  EXPECT_EQ(mesh->vertices[2], Vec3f(1, 1, 0));
  EXPECT_THAT(mesh->triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_THAT(decode_ply_mesh(bytes_of(changed(kPlySquare, "0 1 2 3\n", "0 1 2 4\n"))).error(),
              HasSubstr("face 0: no such vertex"));
  EXPECT_THAT(decode_ply_mesh(bytes_of(changed(kPlySquare, "0 0 0", "0 nan 0"))).error(), HasSubstr("not finite"));
  EXPECT_THAT(decode_ply_mesh(bytes_of(changed(kPlySquare, "vertex_indices", "other"))).error(), HasSubstr("no faces"));
  expect_valid_or_refused(kPlySquare, [](const std::string& bytes) { return decode_ply_mesh(bytes_of(bytes)); });
}

const std::string kUsdPerson =
    "#usda 1.0\n(upAxis = \"Z\"\nmetersPerUnit = 0.01)\ndef SkelRoot \"person\" {\n"
    "double3 xformOp:translate = (0, 0, 5)\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n"
    "def Skeleton \"bones\" {\nuniform token[] joints = [\"Hips\", \"Hips/Head\"]\n"
    "uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), "
    "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,7,150,1))]\n}\n"
    "def Mesh \"skin\" {\nint[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]\n"
    "point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]\n"
    "double3 xformOp:scale = (2, 2, 2)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]\n}\n"
    "def Mesh \"hidden\" {\ntoken visibility = \"invisible\"\nint[] faceVertexCounts = [3]\n"
    "int[] faceVertexIndices = [0, 1, 2]\npoint3f[] points = [(0,0,0), (1,0,0), (1,1,0)]\n}\n}\n";

TEST(ImportUsdBody, meshes_lie_in_the_scene_and_joints_where_they_are_bound) {
  const auto body = decode_usd_body(bytes_of(kUsdPerson));
  ASSERT_TRUE(body) << body.error();
  ASSERT_EQ(body->mesh.vertices.size(), 4u);
  expect_near(body->mesh.vertices[2], {2, 2, 5});
  EXPECT_THAT(body->mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_EQ(body->states.up, Axis::plus_z);
  EXPECT_EQ(body->states.unit_m, 0.01);
  EXPECT_EQ(body->states.origin, Vec3(0, 7, 155));
  EXPECT_THAT(body->notes, ElementsAre(HasSubstr("1 mesh hidden")));
}

TEST(ImportUsdBody, left_handed_and_mirrored_faces_keep_their_outside) {
  const auto triangles = [](const std::string& text) { return decode_usd_body(bytes_of(text))->mesh.triangles; };
  const std::string left =
      changed(kUsdPerson, "def Mesh \"skin\" {\n", "def Mesh \"skin\" {\nuniform token orientation = \"leftHanded\"\n");
  EXPECT_THAT(triangles(left), ElementsAre(Triangle{0, 2, 1}, Triangle{0, 3, 2}));
  EXPECT_THAT(triangles(changed(left, "(2, 2, 2)", "(2, 2, -2)")), ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
}

TEST(ImportUsdBody, bad_files_are_refused_with_a_reason) {
  const auto reason = [](const std::string& from, const std::string& to) {
    const auto body = decode_usd_body(bytes_of(changed(kUsdPerson, from, to)));
    return body ? std::string() : body.error();
  };
  EXPECT_THAT(reason("[4]", "[5]"), HasSubstr("skin: its faceVertexCounts do not fit"));
  EXPECT_THAT(reason("[0, 1, 2, 3]", "[0, 1, 2, 4]"), HasSubstr("a vertex that does not exist"));
  EXPECT_THAT(reason("[0, 1, 2, 3]", "[0, 1, 2, -4]"), HasSubstr("a vertex that does not exist"));
  EXPECT_THAT(reason("(1,1,0), (0,1,0)", "(1,1,0), (0,nan,0)"), HasSubstr("not finite"));
  EXPECT_THAT(reason("def Mesh \"skin\"", "def Cube \"skin\""), HasSubstr("no mesh: 1 mesh hidden"));
  expect_valid_or_refused(kUsdPerson,
                          [](const std::string& bytes) { return mesh_of(decode_usd_body(bytes_of(bytes))); });
}

// Makes a bust in metres with hair in centimetres. The head joint of its skeleton is not where the skull would have it.
HairParts bust_with_hair() {
  HairstyleOptions options;
  options.strand_count = 300;
  const Groom groom = *make_hairstyle("bob", options);
  HairParts parts;
  parts.name = "bob";
  parts.body_file = "bust.glb";
  StrandFile& file = parts.strands.emplace_back(StrandFile{{}, "hair", "bob.data"});
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    if (!groom.strands[s].rooted) continue;
    for (const Vec3f& x : groom.strand_points(s)) file.strands.points.push_back(100 * x);
    file.strands.strand_begin.push_back(static_cast<std::uint32_t>(file.strands.points.size()));
  }
  ImportedBody& body = parts.body.emplace();
  body.mesh = groom.body.mesh;
  body.states = {Axis::plus_y, Axis::plus_z, 1.0, {}};
  body.add_joint(Bone::head, "Head", {0, 0.01, -0.02});
  body.add_joint(Bone::neck, "Neck", {0, -0.1, -0.03});
  body.state_joints();
  return parts;
}

TEST(ImportBody, the_joint_of_its_skeleton_is_the_head_joint_of_the_hair_too) {
  const HairParts parts = bust_with_hair();
  const auto imported = import_hair_parts(parts, {});
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_THAT(imported->warnings,
              Contains(HasSubstr("bust.glb: the head joint is Head of its skeleton, at 0,0.01,-0.02")));
  EXPECT_THAT(imported->warnings, Not(Contains(HasSubstr("estimated"))));
  expect_near(imported->groom.points[0], parts.strands[0].strands.points[0] / 100 - Vec3f(0, 0.01f, -0.02f));
  expect_near(imported->groom.body.mesh.vertices[0], parts.body->mesh.vertices[0] - Vec3f(0, 0.01f, -0.02f));
}

TEST(ImportBody, its_neck_turns_about_the_joint_of_its_skeleton) {
  HairParts parts = bust_with_hair();
  const auto imported = import_hair_parts(parts, {});
  ASSERT_TRUE(imported) << imported.error();
  // The groom's origin is the head joint, so the neck's place is that of its joint minus (0, 0.01, -0.02).
  expect_near(imported->groom.body.joints[static_cast<std::size_t>(Bone::neck)], {0, -0.11f, -0.01f});
  parts.body->joints[static_cast<std::size_t>(Bone::neck)]->position = {0, 3, 0};
  const auto above = import_hair_parts(parts, {});
  ASSERT_TRUE(above) << above.error();
  EXPECT_LT(above->groom.body.joints[static_cast<std::size_t>(Bone::neck)].y(), 0) << "no neck is above its head";
}

TEST(ImportBody, an_origin_that_is_given_counts_more_than_a_skeleton) {
  const HairParts parts = bust_with_hair();
  HairImport import;
  import.strands.origin = Vec3(0, -3, 0);
  const auto imported = import_hair_parts(parts, import);
  ASSERT_TRUE(imported) << imported.error();
  expect_near(imported->groom.points[0], parts.strands[0].strands.points[0] / 100 - Vec3f(0, -0.03f, 0));
  expect_near(imported->groom.body.mesh.vertices[0], parts.body->mesh.vertices[0] - Vec3f(0, -0.03f, 0));
}

TEST(ImportBody, a_stated_unit_in_which_it_has_no_head_is_guessed_and_told) {
  HairParts parts = bust_with_hair();
  parts.body->states.origin.reset();
  for (Vec3f& x : parts.body->mesh.vertices) x *= 100;
  const auto imported = import_hair_parts(parts, {});
  ASSERT_TRUE(imported) << imported.error();
  EXPECT_THAT(imported->warnings,
              Contains(HasSubstr("bust.glb: its file says 1 m a unit, in which it has no head: taken as 0.01")));
  EXPECT_GT(imported->groom.body.mesh.vertices.size(), 1000u);
}

struct RealBody {
  const char* path;
  std::size_t triangle_count;
  double height_m;
  // The head joint of the skeleton must lie within this distance of where the skull would have it. Avatars have none,
  // since their heads may be no skulls.
  std::optional<double> from_skull_m;
};

TEST(ImportRealBody, all_are_read_with_their_size_and_the_joint_of_a_persons_head_is_at_the_skull) {
  if (!std::filesystem::exists(test::shared_data() / "avatar"))
    GTEST_SKIP() << "no real bodies at " << test::shared_data();
  for (const RealBody& real : {RealBody{"avatar/Godette_vrm_v4.vrm", 3439, 1.5, {}},
                               {"avatar/chill_penguin.vrm", 3958, 1.6, {}},
                               {"avatar/debug_robot_vrm1.vrm", 792, 2.23, {}},
                               {"avatar/smoke_spring_vrm1.vrm", 2400, 0.6, {}},
                               {"avatar/sphere_vrm0.vrm", 960, 1, {}},
                               {"import/gltf/VALID_Hispanic_F_2_Casual.glb", 58'724, 1.71, 0.03},
                               {"import/gltf/LeePerrySmith_head.glb", 17'684, 7.95, {}}}) {
    const auto body = decode_gltf_body(test::file_bytes(test::shared_data() / real.path));
    ASSERT_TRUE(body) << real.path << ": " << body.error();
    expect_valid(body->mesh);
    Vec3f low = body->mesh.vertices[0], high = low;
    for (const Vec3f& x : body->mesh.vertices) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
    const Vec3f size = high - low;
    std::printf("%s: %zu triangles, %.2f x %.2f x %.2f, face %s", real.path, body->mesh.triangles.size(),
                static_cast<double>(size.x()), static_cast<double>(size.y()), static_cast<double>(size.z()),
                std::string(name_of(*body->states.face)).c_str());
    EXPECT_EQ(body->mesh.triangles.size(), real.triangle_count) << real.path;
    EXPECT_NEAR(static_cast<double>(size.y()), real.height_m, 0.01) << real.path;
    KnownPlacement known = body->states;
    known.origin.reset();
    const auto placed = guess_mesh_placement(body->mesh, known);
    if (body->states.origin) {
      std::printf(", %s at %.3f of %.3f", body->joints[0]->name.c_str(), body->states.origin->y(),
                  static_cast<double>(high.y()));
      EXPECT_GT(body->states.origin->y(), static_cast<double>(low.y() + 0.4f * size.y())) << real.path;
      EXPECT_LT(body->states.origin->y(), static_cast<double>(high.y())) << real.path;
    }
    if (placed) {
      std::printf(", %s", to_string(*placed).c_str());
      if (body->states.origin)
        std::printf(", %.3f m from the skull's", (*placed->origin - *body->states.origin).norm());
    } else {
      std::printf(", %s", placed.error().c_str());
    }
    std::printf("\n");
    if (!real.from_skull_m) continue;
    ASSERT_TRUE(placed && body->states.origin) << real.path;
    EXPECT_LT((*placed->origin - *body->states.origin).norm(), *real.from_skull_m) << real.path;
  }
}

TEST(ImportRealBody, text_and_binary_usd_have_the_same_mesh) {
  const std::filesystem::path folder = test::shared_data() / "import/usd";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real USD files at " << folder;
  const auto text = decode_usd_body(test::file_bytes(folder / "blender283_hair_10.usda"));
  const auto binary = decode_usd_body(test::file_bytes(folder / "blender283_hair_10.usdc"));
  ASSERT_TRUE(text && binary) << (text ? binary.error() : text.error());
  EXPECT_EQ(text->mesh.triangles, binary->mesh.triangles);
  ASSERT_EQ(text->mesh.vertices.size(), binary->mesh.vertices.size());
  for (std::size_t v = 0; v < text->mesh.vertices.size(); ++v)
    expect_near(text->mesh.vertices[v], binary->mesh.vertices[v]);
  const auto bound = decode_usd_body(test::file_bytes(folder / "openusd_skel_curves_mesh.usda"));
  ASSERT_TRUE(bound) << bound.error();
  EXPECT_EQ(bound->mesh.triangles.size(), 60u);
}

}  // namespace
}  // namespace hairnet
