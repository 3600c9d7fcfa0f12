#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>

#include "client/assets/export/strand_writer.hpp"
#include "client/assets/import/head_files.hpp"
#include "client/tools/command_line/hair_flags.hpp"
#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/parse.hpp"
#include "client/tools/command_line/run_program.hpp"
#include "client/tools/command_line/stop_signal.hpp"
#include "client/tools/groom/commands.hpp"

namespace {

using namespace hairnet;

constexpr const char* kFooter = R"(Examples:
  hairnet-groom make long_curly --length 0.45 --curl 0.8 --strands 8000 --out curls.groom
  hairnet-groom make bob --material wet --group-material fringe=stiff --out bob.groom
  hairnet-groom make short --out short.groom
  hairnet-groom import straight.hair --out straight.groom
  hairnet-groom import back.tfx side.tfx tail.tfx --body head.obj --out tail.groom
  hairnet-groom import guides.abc --fill 20000 --json --out filled.groom
  hairnet-groom import 'hair/*.ply' --out parts.groom
  hairnet-groom import short.data --face -y --roots last --strict --out short.groom
  hairnet-groom export curls.groom --out curls.abc
  hairnet-groom export made:bob --out bob.usda
  hairnet-groom export straight.hair --out straight.npz
  hairnet-groom inspect curls.groom --levels
  hairnet-groom levels curls.groom --out curls.levels
  hairnet-groom learn curls.groom bob.groom --levels /var/cache/hairnet/levels
  hairnet-groom learn curls.groom --embed upload
  hairnet-groom list
)";

void add_hairstyle_flags(CLI::App& app, HairstyleOptions& o) {
  app.add_option("--length", o.length_m, "metres (the style's own)")->check(in_range(0.01, 1.2, "metres"));
  app.add_option("--curl", o.curl, "0 straight ... 1 tight curls (the style's own)")->check(in_range(0, 1));
  app.add_option("--strands", o.strand_count, "density (the style's own, 10000 or so)")->check(CLI::Range(10, 100000));
  app.add_option("--seed", o.seed, "another head of the same style (1)");
}

Material named_material(const char* flag, const std::string& name) {
  const Result<Material> material = make_material(name);
  if (!material) throw CLI::ValidationError(flag, material.error());
  return *material;
}

void add_material_flags(CLI::App& app, groom::MaterialOptions& o) {
  app.add_option_function<std::string>(
      "--material", [&o](const std::string& name) { o.material = named_material("--material", name); },
      "of all hair: soft, normal, stiff, gelled or wet (normal)");
  constexpr const char* kGroupFlag = "--group-material";
  app.add_option_function<std::vector<std::string>>(
         kGroupFlag,
         [&o](const std::vector<std::string>& texts) {
           for (const std::string& text : texts) {
             // From the right, since a group's name may contain an equals sign.
             const std::size_t equals = text.rfind('=');
             if (equals == std::string::npos)
               throw CLI::ValidationError(kGroupFlag, "'" + text + "' is not GROUP=MATERIAL");
             o.group_materials.emplace_back(text.substr(0, equals),
                                            named_material(kGroupFlag, text.substr(equals + 1)));
           }
         },
         "of one group's hair: GROUP=MATERIAL; once for each")
      // One value for each flag: a second word is no second value, but an error.
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_import(CLI::App& app, groom::ImportOptions& o, std::vector<double>& origin) {
  CLI::App& import =
      *app.add_subcommand("import", "strands that people have (" + strand_extensions() + "), to a groom file");
  import
      .add_option("files", o.files.files,
                  "strand files of one head, folders of them, patterns; each becomes a group, or several if it names "
                  "them")
      ->required();
  import.add_option("--out,-o", o.out, "groom file to write")->required();
  add_hair_flags(import, "--", o.import);
  import
      .add_option("--origin", origin,
                  "head joint in file units, x,y,z (the body's, else under its skull, else the roots')")
      ->delimiter(',')
      ->expected(3);
  import.add_option("--body", o.files.body,
                    "the head or body under the hair (" + std::string(kBodyFiles) +
                        "), tells the head joint too (a skull fitted to the roots)");
  add_parsed(import, "--body-up", o.import.body.up, "the body's axis that points up (the file's own, else guessed)",
             parse_axis);
  add_parsed(import, "--body-face", o.import.body.face,
             "the body's axis that its face looks along (the file's own, else guessed)", parse_axis);
  import
      .add_option("--body-unit", o.import.body.unit_m,
                  "metres a unit of the body's file (the file's own, else guessed)")
      ->check(in_range(1e-6, 1e3));
  import.add_option("--group", o.files.groups,
                    "name of each file's group, in order (what the files say, or their names)");
  import
      .add_option("--fill", o.import.fill,
                  "strands in all: the files hold guides, between which others are filled in over the scalp (none)")
      ->check(CLI::Range(std::size_t{4}, GroomLimits{}.strand_count_max));
  import.add_option("--hairs", o.import.hairs_in_all, "real hairs on the whole head (100000)")->check(in_range(1, 1e7));
  import.add_option("--root-length", o.root_length_m, "m of hair that stays with the skin, lambda_0 (the material's)")
      ->check(in_range(0, 10));
  import.add_option("--root-spread", o.root_spread, "each strand's own lambda_0 is up to this share more or less (0)")
      ->check(in_range(0, 0.95));
  add_material_flags(import, o.materials);
  import.add_option("--name", o.files.name, "the groom's name (the out file's)");
  import.add_flag("--json", o.json, "print what was made, taken and left out as JSON");
}

CLI::App& add_export(CLI::App& app, groom::ExportOptions& o) {
  CLI::App& out = *app.add_subcommand("export", "a groom's strands, to a file of other programs, in m, y up, face +z");
  out.add_option("groom", o.groom, "groom file, strand file (" + strand_extensions() + "), or made:STYLE")->required();
  out.add_option("--out,-o", o.out, "file to write; its ending is its format: " + exported_extensions())->required();
  add_hairstyle_flags(out, o.hairstyle);
  add_hair_flags(out, "--hair-", o.import);
  return out;
}

CLI::App& add_learn(CLI::App& app, groom::LearnOptions& o) {
  CLI::App& learn = *app.add_subcommand(
      "learn", "the hair of groom files by example, so that no server has to: a minute or more for each");
  learn.add_option("grooms", o.grooms, "groom files, as clients upload them")->required();
  CLI::Option_group& folders = *learn.add_option_group("Folders, one or both");
  folders.add_option("--levels", o.levels, "of a server's level cache (its --level-cache), to write to");
  folders.add_option("--embed", o.embed, "for copies of the files with the learnt hair inside, to upload");
  // At least one of both: learning without a place for the result would be in vain.
  folders.require_option(1, 2);
  learn.add_flag("--again", o.again, "also hair that is already learnt");
  return learn;
}

int report(const Result<void>& done) {
  if (done) return 0;
  std::fprintf(stderr, "hairnet-groom: %s\n", done.error().c_str());
  return 1;
}

int run(int argc, char** argv) {
  CLI::App app("Imports, exports, makes, inspects and learns hairstyles.", "hairnet-groom");
  app.footer(kFooter);
  // Without a command there is nothing to do, which is an error of the command line.
  app.require_subcommand(1);
  groom::ImportOptions import;
  std::vector<double> origin;
  add_import(app, import, origin);
  groom::ExportOptions exported;
  const CLI::App& export_app = add_export(app, exported);
  groom::MakeOptions make;
  CLI::App& make_app = *app.add_subcommand("make", "one of our own hairstyles, to a groom file");
  make_app.add_option("style", make.style, "see 'hairnet-groom list'")->required();
  make_app.add_option("--out,-o", make.out, "groom file to write")->required();
  add_hairstyle_flags(make_app, make.hairstyle);
  add_material_flags(make_app, make.materials);
  groom::InspectOptions inspect;
  CLI::App& inspect_app = *app.add_subcommand("inspect", "what a groom holds, and how its levels are built");
  inspect_app.add_option("groom", inspect.groom, "groom file, or made:STYLE")->required();
  inspect_app.add_flag("--levels", inspect.levels, "build the levels and modes: counts, errors, times");
  add_hairstyle_flags(inspect_app, inspect.hairstyle);
  groom::LevelsOptions levels;
  CLI::App& levels_app =
      *app.add_subcommand("levels", "the mechanical models of a groom file, for pages and programs without a server");
  levels_app.add_option("groom", levels.groom, "groom file")->required();
  levels_app.add_option("--out,-o", levels.out, "file to write (beside the groom, .levels)");
  groom::LearnOptions learn;
  const CLI::App& learn_app = add_learn(app, learn);
  CLI::App& list_app = *app.add_subcommand("list", "our own hairstyles and motions");
  if (const auto exit_status = parse_command_line(app, argc, argv)) return *exit_status;
  // CLI11 has checked that there are three numbers, or none.
  if (origin.size() == 3) import.import.strands.origin = Vec3(origin[0], origin[1], origin[2]);
  if (app.got_subcommand("import")) return report(groom::import_groom(import));
  if (export_app.parsed()) return report(groom::export_groom(exported));
  if (make_app.parsed()) return report(groom::make_groom(make));
  if (inspect_app.parsed()) return report(groom::inspect_groom(inspect));
  if (levels_app.parsed()) return report(groom::write_levels(levels));
  if (learn_app.parsed()) {
    // Only learning takes so long that a stop must be asked for.
    install_stop_signal_handlers();
    learn.is_stopped = stop_requested;
    return report(groom::learn_grooms(learn));
  }
  if (list_app.parsed()) groom::list_made();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return hairnet::run_program("hairnet-groom", [&] { return run(argc, argv); });
}
