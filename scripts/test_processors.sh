#!/bin/sh
# Test what rounds as it would on other processors: sh scripts/test_processors.sh PYTHON
#
# Libraries choose their kernels by what the processor can, and split sums by threads, so they round
# differently. Here they are told which to take: oneDNN and PyTorch, MKL, OpenBLAS (in NumPy and
# SciPy), NumPy, Numba and OpenCV. ONNX Runtime can't be told.
#
#   TESTS=tests/golden   other tests
set -eu

python=$1
tests=${TESTS:-tests/unit/models tests/unit/encodings tests/unit/lab/live tests/golden}

test_as() {
    echo "== as $1"
    shift
    env "$@" "$python" -m pytest -q -m 'not slow and not system' $tests
}

test_as "this processor, two threads" OMP_NUM_THREADS=2 MKL_NUM_THREADS=2
test_as "this processor, one thread" OMP_NUM_THREADS=1 MKL_NUM_THREADS=1
# All else as it is: a sample that lies at the edge between two textures moves with any one library,
# and where all are told at once it may move back.
test_as "this processor, with OpenBLAS as on one without AVX2" OPENBLAS_CORETYPE=Nehalem
test_as "a processor with AVX2 and no AVX-512" \
    ONEDNN_MAX_CPU_ISA=AVX2 ATEN_CPU_CAPABILITY=avx2 OPENBLAS_CORETYPE=Haswell \
    NPY_DISABLE_CPU_FEATURES="X86_V4 AVX512_ICL AVX512_SPR" \
    NUMBA_CPU_NAME=haswell NUMBA_CPU_FEATURES= OPENCV_CPU_DISABLE=AVX512-SKX
test_as "AMD's Zen" \
    ONEDNN_MAX_CPU_ISA=AVX2 ATEN_CPU_CAPABILITY=avx2 OPENBLAS_CORETYPE=Zen MKL_CBWR=AVX2 \
    NPY_DISABLE_CPU_FEATURES="X86_V4 AVX512_ICL AVX512_SPR" \
    NUMBA_CPU_NAME=znver1 NUMBA_CPU_FEATURES= OPENCV_CPU_DISABLE=AVX512-SKX
if grep -q avx512vl /proc/cpuinfo; then
    test_as "Intel's SkylakeX" \
        ONEDNN_MAX_CPU_ISA=AVX512_CORE ATEN_CPU_CAPABILITY=avx512 OPENBLAS_CORETYPE=SkylakeX \
        NPY_DISABLE_CPU_FEATURES="AVX512_ICL AVX512_SPR" \
        NUMBA_CPU_NAME=skylake-avx512 NUMBA_CPU_FEATURES=
else
    echo "== not as Intel's SkylakeX: this processor has no AVX-512"
fi
test_as "a processor with nothing above SSE 4" \
    ONEDNN_MAX_CPU_ISA=SSE41 ATEN_CPU_CAPABILITY=default OPENBLAS_CORETYPE=Nehalem \
    MKL_CBWR=COMPATIBLE NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4 AVX512_ICL AVX512_SPR" \
    NUMBA_CPU_NAME=x86-64-v2 NUMBA_CPU_FEATURES= OPENCV_CPU_DISABLE=AVX512-SKX,AVX2,FP16,AVX
