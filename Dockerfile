# gears3d with the 3D engine and the replay, from this checkout:
#   docker build --tag gears3d .
#   docker run --rm --volume "$PWD/runs:/work/runs" gears3d                # the demo: runs/demo with its report and replay
#   docker run --rm --volume "$PWD:/work" gears3d diagnose record.csv --rig rig.toml --out found
FROM python:3.11-slim-bookworm AS build
WORKDIR /source
RUN python -m venv /opt/gears3d
ENV PATH=/opt/gears3d/bin:$PATH PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
COPY pyproject.toml README.md LICENSE ./
COPY gears3d gears3d
COPY scenarios scenarios
RUN pip install ".[engine,replay]"

FROM python:3.11-slim-bookworm
LABEL org.opencontainers.image.title="gears3d" org.opencontainers.image.licenses="MIT"
RUN useradd --create-home --uid 1000 gears && install --directory --owner=gears /work /work/runs
# owned by the user: numba loads kernels only from a folder that it may write
COPY --from=build --chown=gears /opt/gears3d /opt/gears3d
COPY scenarios /opt/scenarios
ENV PATH=/opt/gears3d/bin:$PATH
USER gears
WORKDIR /work
# compiles the kernels, so that no container has to
RUN gears3d run /opt/scenarios/rigaud-2020/fig5-20rpm.toml --set "run.duration=1 s" --out /tmp/first && rm -r /tmp/first
ENTRYPOINT ["gears3d"]
CMD ["run", "/opt/scenarios/rigaud-2020/fig5-20rpm.toml", "--out", "runs/demo"]
