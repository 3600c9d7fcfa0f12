# Debian packages of the server and of the tools: `deploy/package` makes them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hairnet)
set(CPACK_PACKAGE_VENDOR Hairnet)
set(CPACK_PACKAGE_CONTACT "Hairnet developers <hairnet@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL server tools)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION net)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)   # dependencies from what the programs link
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
# Debian wants /etc, not /usr/etc.
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_SOURCE_DIR}/cmake/move_etc.cmake)

set(debian ${CMAKE_CURRENT_SOURCE_DIR}/debian)
set(CPACK_DEBIAN_SERVER_PACKAGE_NAME hairnet-server)
set(CPACK_COMPONENT_SERVER_DESCRIPTION "hairnet-server takes head poses from clients, steps one lattice a character at
a fixed rate, and streams the lattices to every client in the room.")
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
    ${debian}/conffiles ${debian}/postinst ${debian}/prerm ${debian}/postrm)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME hairnet-tools)
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "hairnet-groom imports and makes hairstyles, hairnet-view streams and draws
them, hairnet-sim simulates files, hairnet-token makes access tokens, hairnet-load
measures how many characters a server can serve.")
# Drawing without a screen; what the window loads by name; videos.
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "libgl1-mesa-dri, libgl1, ffmpeg")
include(CPack)
