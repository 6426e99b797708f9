/* One translation unit for every PETSc header the program uses. */
#include <petscksp.h>
#include <petscerror.h>
