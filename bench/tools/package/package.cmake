# What `cmake --install` and CPack's .deb put where: the program, its data, the headers that are meant to be used, the
# library, and what find_package(ricochet) reads. An installed program needs no source tree.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_CURRENT_LIST_DIR})
set(headers_dir ${CMAKE_INSTALL_INCLUDEDIR}/ricochet)
set(data_dir ${CMAKE_INSTALL_DATADIR}/ricochet)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ricochet)

# Methods and scenes register themselves, so whoever links the library takes the whole of it.
add_library(ricochet_library STATIC $<TARGET_OBJECTS:ricochet_problems> $<TARGET_OBJECTS:ricochet_reference>
  $<TARGET_OBJECTS:ricochet_certified> $<TARGET_OBJECTS:ricochet_methods> $<TARGET_OBJECTS:ricochet_contact_files>
  $<TARGET_OBJECTS:ricochet_siconos_contact_solver>
  $<$<TARGET_EXISTS:ricochet_siconos>:$<TARGET_OBJECTS:ricochet_siconos>>)
set_target_properties(ricochet_library PROPERTIES OUTPUT_NAME ricochet LINKER_LANGUAGE CXX)

install(TARGETS ricochet RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
if(NOT RICOCHET_SANITIZE)
  install(TARGETS bench_step bench_contacts bench_tableaus bench_derivatives bench_transcription
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/bench/experiments DESTINATION ${data_dir}/bench COMPONENT program)
install(PROGRAMS ${PROJECT_SOURCE_DIR}/bench/tools/history/make_history DESTINATION ${data_dir}/bench/tools/history COMPONENT program)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/reports/baselines DESTINATION ${data_dir}/reports COMPONENT program)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/reference/data DESTINATION ${data_dir}/reference COMPONENT program)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${data_dir} COMPONENT program USE_SOURCE_PERMISSIONS)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/bench/tools/python/ricochet DESTINATION lib/python3/dist-packages
  COMPONENT program PATTERN __pycache__ EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/CITATION.cff ${PROJECT_SOURCE_DIR}/CHANGELOG.md
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

# The interface: what a user includes, and what that includes.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${package_dir}/headers.txt)
file(STRINGS ${package_dir}/headers.txt public_headers REGEX "^[^#]")
foreach(header ${public_headers})
  get_filename_component(folder ${header} DIRECTORY)
  string(REGEX REPLACE "^bench(/.*)?$" "" folder "${folder}")  # the two that a user names: ricochet/ricochet.h, ricochet/plugin.h
  install(FILES ${PROJECT_SOURCE_DIR}/${header} DESTINATION ${headers_dir}/${folder} COMPONENT development)
endforeach()
install(TARGETS ricochet_library ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)

# What the library needs, for whoever links it.
if(TARGET arb::arb)
  set(certified_libraries ${ARB_LIBRARY} ${FLINT_LIBRARY})
endif()
set(RICOCHET_LINK_LIBRARIES fmt ginac cln ipopt gsl gslcblas lapack blas sundials_cvode sundials_arkode sundials_ida
  sundials_nvecserial sundials_sunmatrixdense sundials_sunlinsoldense sundials_sunnonlinsolfixedpoint
  ${certified_libraries} ${SICONOS_KERNEL_LIBRARY} ${SICONOS_NUMERICS_LIBRARY} ${HDF5_SERIAL_HL_LIBRARY} ${HDF5_SERIAL_LIBRARY})
list(FILTER RICOCHET_LINK_LIBRARIES EXCLUDE REGEX "NOTFOUND$")
string(REPLACE ";" " " RICOCHET_LINK_LIBRARIES "${RICOCHET_LINK_LIBRARIES}")

configure_package_config_file(${package_dir}/ricochet-config.cmake.in ricochet-config.cmake
  INSTALL_DESTINATION ${config_dir} PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(ricochet-config-version.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ricochet-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/ricochet-config-version.cmake
  DESTINATION ${config_dir} COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ricochet)
set(CPACK_PACKAGE_CONTACT "the authors of Ricochet <ricochet@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "benchmark and verification suite for rigid-body motion with impacts and friction")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "gnuplot-nox, python3-numpy, python3-pandas")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libeigen3-dev, libfmt-dev, nlohmann-json3-dev, libginac-dev, coinor-libipopt-dev, libsundials-dev, libgsl-dev, liblapack-dev, libcln-dev")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_STRIP_FILES ON)
include(CPack)
