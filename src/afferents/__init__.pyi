from . import benchmark as benchmark, lab as lab, plot as plot
from .channels import (
    CHANNELS as CHANNELS,
    Channel as Channel,
    marker_speed as marker_speed,
    ra1 as ra1,
    ra2 as ra2,
    sa1 as sa1,
)
from .encodings.augment import (
    stretch_spectrum as stretch_spectrum,
)
from .encodings.base import (
    VibrationEncoding as VibrationEncoding,
)
from .encodings.images import (
    ImageEncoding as ImageEncoding,
    SpatialEncoding as SpatialEncoding,
    SpatiotemporalEncoding as SpatiotemporalEncoding,
    spatial_samples as spatial_samples,
    spatiotemporal_samples as spatiotemporal_samples,
)
from .encodings.log_spectra import (
    LogSpectra as LogSpectra,
)
from .encodings.orders import (
    OrderEncoding as OrderEncoding,
)
from .encodings.settings import (
    ENCODINGS as ENCODINGS,
)
from .encodings.spectra import (
    SpectralEncoding as SpectralEncoding,
    spectral_samples as spectral_samples,
)
from .encodings.wavenumbers import (
    WavenumberEncoding as WavenumberEncoding,
)
from .evaluation.controls import (
    ControlsFound as ControlsFound,
    controls as controls,
)
from .evaluation.evaluate import (
    evaluate as evaluate,
    samples as samples,
)
from .evaluation.metrics import (
    accuracy_interval as accuracy_interval,
)
from .evaluation.results import (
    load_results as load_results,
)
from .evaluation.train import (
    load_model as load_model,
    train as train,
)
from .examples import (
    example as example,
)
from .extraction.extract import (
    extract as extract,
)
from .extraction.track import (
    track as track,
)
from .filling import (
    fill as fill,
    hold as hold,
)
from .folds.splits import (
    LeaveOneGroupOut as LeaveOneGroupOut,
    LeaveOneSpeedOut as LeaveOneSpeedOut,
)
from .inspection.calibrate import (
    calibrate as calibrate,
)
from .inspection.init import (
    init_session as init_session,
)
from .inspection.inspect import (
    inspect as inspect,
)
from .lab.live.fingertip import (
    stream as stream,
)
from .lab.live.touch import (
    Touch as Touch,
)
from .lab.recorder.importing import (
    import_recording as import_recording,
)
from .lab.recorder.record import (
    record as record,
)
from .markers.sensor import (
    load_sensor as load_sensor,
)
from .markers.track import (
    Tracker as Tracker,
)
from .models.classifiers import (
    CLASSIFIERS as CLASSIFIERS,
)
from .models.config import (
    training_config as training_config,
)
from .models.export import (
    export as export,
)
from .models.model import (
    MODELS as MODELS,
    Model as Model,
)
from .neuro.natural import (
    read_nwb as read_nwb,
    read_spikes as read_spikes,
)
from .neuro.neural import (
    neural as neural,
)
from .neuro.nwb import (
    export_nwb as export_nwb,
)
from .recordings.audio import (
    WavFile as WavFile,
)
from .recordings.data_set import (
    DataSet as DataSet,
)
from .recordings.data_sets import (
    DATA_SETS as DATA_SETS,
    read_session as read_session,
)
from .recordings.fetch import (
    fetch as fetch,
)
from .recordings.session import (
    Session as Session,
)
from .recordings.video import (
    open_video as open_video,
)
from .reporting.explain import (
    explain as explain,
)
from .reporting.report import (
    report as report,
)
from .reproduction.reproduce import (
    reproduce as reproduce,
)
from .rig.simulate import (
    simulate as simulate,
)
from .robots.bags import (
    export_mcap as export_mcap,
)
from .robots.lerobot import (
    export_lerobot as export_lerobot,
)
from .robots.viewer import (
    view as view,
)
from .spikes.artificial import (
    artificial_spikes as artificial_spikes,
)
from .spikes.population import (
    Spikes as Spikes,
)
from .store.recording import (
    Recording as Recording,
)
from .store.responses import (
    Responses as Responses,
)
from .store.zarr_store import (
    open_responses as open_responses,
)
from .version import __version__ as __version__
