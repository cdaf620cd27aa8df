"""Many records: each diagnosed, none lost, and one verdict on all of them."""

from ._batch import Batch as Batch
from ._batch import RecordResult as RecordResult
from ._many import diagnose_many as diagnose_many
from ._many import many as many
from ._options import Settings as Settings
from ._outcome import Failure as Failure
from ._source import Source as Source
from ._source import sources_of as sources_of
from ._spread import Spread as Spread
from ._spread import spread_of as spread_of
