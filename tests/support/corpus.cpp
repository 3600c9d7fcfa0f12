#include "tests/support/corpus.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "client/assets/import/obj.hpp"
#include "client/assets/import/strands.hpp"
#include "client/assets/load_groom.hpp"
#include "client/assets/load_motion.hpp"
#include "client/assets/made_spec.hpp"
#include "client/assets/upright.hpp"
#include "client/files/read_file.hpp"
#include "tests/support/bvh_text.hpp"
#include "tests/support/deepmimic_clip.hpp"

namespace hairnet::fidelity {
namespace {

// A clip begins with this time of easing from upright rest into the motion's first pose.
constexpr double kLeadIn_s = 1;
// The clips of DeepMimic are resampled to this rate.
constexpr double kDeepMimicRate_hz = 60;

const std::filesystem::path kData = HAIRNET_SHARED_DIR;

// A hairstyle as its files have to be read (units, axes).
struct RealGroom {
  std::string_view name;
  StrandDecoder* decode;
  std::vector<std::string> files;
  // The axis that is up, the axis that the face looks along, and the metres of a unit of the file. The head joint stays
  // open: it comes from the body or the roots.
  Placement placement;
  // The file of the body. Without one a skull is fitted to the roots of the hair.
  std::string body;
  std::optional<Placement> body_placement;
};

const std::vector<RealGroom>& real_grooms() {
  // The files of yuksel and ponytail state no unit. The widths of their scalps give about 3.3 mm and a tenth of an
  // inch (SOURCES.md in the data folder).
  static const std::vector<RealGroom> grooms{{"yuksel",
                                              decode_yuksel_hair,
                                              {"hair/yuksel_straight/straight.hair"},
                                              {Axis::plus_z, Axis::plus_y, 0.0033, {}},
                                              {},
                                              {}},
                                             {"ponytail",
                                              decode_tressfx,
                                              {"hair/amd_ponytail/back.tfx", "hair/amd_ponytail/front_top.tfx",
                                               "hair/amd_ponytail/side.tfx", "hair/amd_ponytail/tail.tfx"},
                                              {Axis::plus_y, Axis::minus_z, 0.00254, {}},
                                              "head/amd_ponytail_head_max4.obj",
                                              Placement{Axis::plus_y, Axis::plus_z, 0.00254, {}}},
                                             {"harolongo",
                                              decode_usc_data,
                                              {"hair/harolongo/harolongo.data"},
                                              {Axis::plus_y, Axis::plus_z, 0.01, {}},
                                              "head/digitalsalon_female_body_scaled.obj",
                                              {}},
                                             {"sintel",
                                              decode_tressfx,
                                              {"hair/sintel/SintelHairOriginal-sintel_hair.16points.tfx"},
                                              {},
                                              "head/sintel.obj",
                                              {}}};
  return grooms;
}

Refusal of(std::string_view what, const std::string& reason) {
  return Refusal(std::string(what) + ": " + reason);
}

Result<Groom> import_real(const RealGroom& real) {
  GroomDef def;
  def.name = real.name;
  for (const std::string& file : real.files) {
    const auto bytes = read_file((kData / file).string());
    if (!bytes) return of(file, bytes.error());
    auto strands = real.decode(*bytes);
    if (!strands) return of(file, strands.error());
    def.files.push_back({std::move(*strands), std::filesystem::path(file).stem().string()});
  }
  if (!real.body.empty()) {
    const auto bytes = read_file((kData / real.body).string());
    if (!bytes) return of(real.body, bytes.error());
    auto mesh = decode_obj(as_text(*bytes));
    if (!mesh) return of(real.body, mesh.error());
    def.body = std::move(*mesh);
  }
  def.placement = real.placement;
  def.body_placement = real.body_placement;
  auto imported = assemble_groom(def);
  if (!imported) return of(real.name, imported.error());
  return std::move(imported->groom);
}

Result<Motion> import_deepmimic(std::string_view name, const Body& body) {
  const std::string file = "motion/deepmimic_humanoid3d_" + std::string(name) + ".txt";
  const auto bytes = read_file((kData / file).string());
  if (!bytes) return of(file, bytes.error());
  const Result<DeepMimicClip> clip = decode_deepmimic_clip(as_text(*bytes), kDeepMimicRate_hz);
  if (!clip) return of(file, clip.error());
  // The people of DeepMimic look along +x (deepmimic_clip.hpp), and Hairnet's along +z.
  BvhImport import;
  import.face = Axis::plus_x;
  auto imported = decode_bvh(bvh_text(*clip), import, &body);
  if (!imported) return of(file, imported.error());
  return std::move(imported->motion);
}

Motion named(Motion motion, std::string_view name) {
  motion.name = name;
  return motion;
}

}  // namespace

bool has_real_data() {
  return std::filesystem::is_directory(kData);
}

std::vector<std::string> made_grooms() {
  std::vector<std::string> names;
  for (const MadeName& made : hairstyle_names()) names.push_back(std::string(kMadePrefix) + std::string(made.name));
  return names;
}

Result<Groom> load_groom(std::string_view name, std::size_t made_strand_count) {
  const auto& reals = real_grooms();
  const auto real = std::ranges::find(reals, name, &RealGroom::name);
  if (real != reals.end()) return import_real(*real);
  HairstyleOptions options;
  options.strand_count = made_strand_count;
  return hairnet::load_groom(std::string(name), options);
}

Result<Motion> load_motion(std::string_view name, const Body& body) {
  Result<Motion> motion;
  if (std::ranges::find(kRealMotions, name) == std::end(kRealMotions)) {
    motion = hairnet::load_motion(std::string(name), {}, &body);
  } else if (name.starts_with("cmu_")) {
    const std::string file = "motion/cmu_scaled_" + std::string(name.substr(4)) + ".bvh";
    motion = hairnet::load_motion((kData / file).string(), {}, &body);
  } else {
    motion = import_deepmimic(name, body);
  }
  if (!motion) return motion;
  return named(std::move(*motion), name);
}

Clip make_clip(const Motion& motion, double rate_hz, double duration_s) {
  // The 1e-9 takes away rounding, which would otherwise add a tick to a whole number of ticks.
  Clip clip{motion.name, rate_hz, {}, static_cast<std::size_t>(std::ceil(kLeadIn_s * rate_hz - 1e-9))};
  const Pose first = motion.sample(0);
  for (std::size_t i = 0; i < clip.lead_in_ticks; ++i) {
    // ease() leaves upright(first) at 0 s and reaches the motion's first pose at kLeadIn_s.
    clip.poses.push_back(rounded_to_wire(ease(upright(first), first, static_cast<double>(i) / rate_hz, kLeadIn_s)));
  }
  const double end_s = std::min(duration_s, motion.duration_s());
  const auto tick_count = static_cast<std::size_t>(std::ceil(end_s * rate_hz - 1e-9));
  for (std::size_t i = 0; i <= tick_count; ++i) {
    clip.poses.push_back(rounded_to_wire(motion.sample(static_cast<double>(i) / rate_hz)));
  }
  return clip;
}

}  // namespace hairnet::fidelity
