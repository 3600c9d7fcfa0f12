#include <cstdio>

#include "client/files/write_file.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/save_groom.hpp"

namespace hairnet::groom {

Result<void> make_groom(const MakeOptions& options) {
  // This is checked before hair is made.
  if (const Result<void> possible = check_can_write({options.out}); !possible) return possible;
  Result<Groom> made = make_hairstyle(options.style, options.hairstyle);
  if (!made) return Refusal("made:" + options.style + ": " + made.error());
  if (const Result<void> applied = apply_materials(options.materials, *made); !applied) return applied;
  return save_groom(*made, options.out);
}

void list_made() {
  const auto print = [](const char* title, std::span<const MadeName> names) {
    std::printf("%s\n", title);
    for (const MadeName& made : names) {
      std::printf("  made:%-14.*s %.*s\n", static_cast<int>(made.name.size()), made.name.data(),
                  static_cast<int>(made.description.size()), made.description.data());
    }
  };
  print("hairstyles", hairstyle_names());
  print("motions", motion_names());
}

}  // namespace hairnet::groom
