#pragma once

#include <memory>
#include <string>

#include "client/assets/import_hair.hpp"
#include "client/assets/made/made.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

struct LearntHair;

// Loads what a command line names as a groom: a groom file's path, a strand file of another program, read with
// `import`, or `made:STYLE` with the options `made`. An error begins with the name. The file's extension decides, and
// not its bytes: an unknown extension is a groom file. Warnings of an import go to stderr.
Result<Groom> load_groom(const std::string& spec, const HairstyleOptions& made = {}, const HairImport& import = {});
// The learnt hair in the file that it names, to upload with the groom; null: none, or made. Strands of other programs
// and made styles have no learnt hair, since a groom file alone can hold it. This call reads the file again.
Result<std::shared_ptr<const LearntHair>> load_learnt(const std::string& spec);

}  // namespace hairnet
