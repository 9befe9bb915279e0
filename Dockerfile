# afferents for processors, without CUDA; as a user who is not root.
#
#   docker build --build-arg VERSION="$(python -m setuptools_scm)" --tag afferents .
#   docker run --rm --volume "$PWD:/data" --user "$(id -u):$(id -g)" afferents extract SESSION OUT.zarr
#   docker run --rm --publish 127.0.0.1:8800:8800 afferents live --video rig --web --host 0.0.0.0

FROM python:3.12-slim AS build
# There is no git here to ask for it.
ARG VERSION=0.1.0.dev0
ENV SETUPTOOLS_SCM_PRETEND_VERSION_FOR_AFFERENTS=$VERSION
WORKDIR /build
COPY . .
RUN pip wheel --no-cache-dir --no-deps --wheel-dir dist .

FROM python:3.12-slim
COPY --from=build /build/dist /build/constraints.txt /tmp/dist/
RUN pip install --no-cache-dir --extra-index-url https://download.pytorch.org/whl/cpu \
        --constraint /tmp/dist/constraints.txt "afferents[train] @ file://$(ls /tmp/dist/*.whl)" \
    && rm -r /tmp/dist \
    && useradd --create-home --uid 1000 afferents \
    && install --directory --owner afferents /data
ENV HOME=/home/afferents \
    MPLBACKEND=Agg
USER 1000
WORKDIR /data
ENTRYPOINT ["afferents"]
CMD ["--help"]
