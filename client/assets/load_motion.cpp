#include "client/assets/load_motion.hpp"

#include <filesystem>
#include <utility>

#include "client/assets/made_spec.hpp"
#include "client/assets/print_warnings.hpp"
#include "client/files/read_file.hpp"

namespace hairnet {

Result<Motion> load_motion(const std::string& spec, const BvhImport& import, const Body* body,
                           const MotionOptions& made) {
  if (is_made_spec(spec)) return make_motion(made_name(spec), made);
  const Result<std::vector<std::byte>> bytes = read_file(spec);
  if (!bytes) return Refusal(bytes.error());
  Result<ImportedMotion> imported = decode_bvh(as_text(*bytes), import, body);
  if (!imported) return Refusal(imported.error());
  print_warnings(spec, imported->warnings);
  // The name inside a .bvh is that of its root joint, which says nothing.
  imported->motion.name = std::filesystem::path(spec).stem().string();
  return std::move(imported->motion);
}

}  // namespace hairnet
