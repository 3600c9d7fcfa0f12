#pragma once

namespace hairnet {

// The project's version, such as "0.1.0".
extern const char* const kVersion;
// What a bug report names: the version and the commit that was built, such as "0.1.0 (55d928a4)", with "-dirty" after
// the commit when files differ from it. The version alone when the source is no git checkout.
extern const char* const kVersionAndCommit;

}  // namespace hairnet
