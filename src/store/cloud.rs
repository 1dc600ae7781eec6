//! A range of an object in a store: `s3`, `gs`, `az`. I/O, by `object_store`.
//!
//! Credentials are those of the environment, as each cloud's own tools take them. Requests go by our own client,
//! which follows no redirect: a signature is for one host.
//!
//! Long because the client is here, too: what it saw of an answer is what a fault is told by.

use super::answer::{Part, Reply, Version};
use super::client::{self, innermost};
use super::fault::{Fault, asked};
use super::patience::Patience;
use bytes::Bytes;
use futures_util::StreamExt;
use http_body_util::{BodyExt, Limited};
use object_store::aws::AmazonS3Builder;
use object_store::azure::MicrosoftAzureBuilder;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse,
    HttpResponseBody, HttpService,
};
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::multipart::{MultipartStore, PartId};
use object_store::path::Path;
use object_store::{
    ClientConfigKey, ClientOptions, Error, GetOptions, GetRange, ObjectStore, ObjectStoreExt,
    RetryConfig,
};
use reqwest::StatusCode;
use std::fmt;
use std::ops::Range;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU16, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;
use strapd_recording::text::snippet;

/// Variables that a cloud's own tools read.
const S3: &str = "AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN, AWS_REGION and AWS_ENDPOINT_URL are looked at; AWS_SKIP_SIGNATURE=true reads what is public";
const GS: &str = "GOOGLE_SERVICE_ACCOUNT (a file) and GOOGLE_APPLICATION_CREDENTIALS are looked at; GOOGLE_SKIP_SIGNATURE=true reads what is public";
const AZ: &str = "AZURE_STORAGE_ACCOUNT_NAME, AZURE_STORAGE_ACCOUNT_KEY, AZURE_STORAGE_SAS_KEY and AZURE_CLIENT_ID are looked at; AZURE_SKIP_SIGNATURE=true reads what is public";

/// Servers that give credentials to machines of a cloud, and answer at once or never.
const METADATA: [&str; 3] = [
    "169.254.169.254",
    "fd00:ec2::254",
    "metadata.google.internal",
];
const METADATA_ANSWERS: Duration = Duration::from_secs(2);

/// Bytes of one page of a listing: a thousand keys of a kilobyte each, and as much again around them, are a fraction.
const MOST_OF_PAGE: usize = 16 << 20;
/// Pages of a listing without a key that may follow each other.
const MOST_EMPTY: usize = 100;

/// An object in a store.
pub(super) struct Cloud {
    store: Arc<dyn ObjectStore>,
    /// The same, as what takes objects in parts.
    parts: Arc<dyn MultipartStore>,
    key: Path,
    scheme: String,
    speaker: Speaker,
}

impl fmt::Debug for Cloud {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Cloud({}, {})", self.scheme, self.key)
    }
}

/// Keys that were listed.
#[derive(Debug, Default)]
pub(super) struct Keys {
    /// Number of keys there were, and how many of them are wanted.
    pub(super) looked_at: usize,
    pub(super) wanted: usize,
    /// The first of those.
    pub(super) kept: Vec<String>,
}

/// A store, as what is read from and as what takes objects in parts.
type Both = (Arc<dyn ObjectStore>, Arc<dyn MultipartStore>);

fn both<S: ObjectStore + MultipartStore>(store: S) -> Both {
    let store = Arc::new(store);
    (store.clone(), store)
}

/// Answer to one request, beside what `object_store` tells of it.
#[derive(Debug, Default)]
struct Answered {
    status: AtomicU16,
    asked_millis: AtomicU64,
    /// Content type of the body, where the store itself answered, and not who gives credentials.
    form: Mutex<Option<String>>,
}

impl Cloud {
    pub(super) fn of(address: &Address, patience: Patience) -> Result<Cloud, Diagnostic> {
        Cloud::at(address, patience, false)
    }

    /// Makes one of a folder, to be listed; without one of all that there is.
    pub(super) fn in_folder(address: &Address, patience: Patience) -> Result<Cloud, Diagnostic> {
        Cloud::at(address, patience, true)
    }

    fn at(address: &Address, patience: Patience, is_folder: bool) -> Result<Cloud, Diagnostic> {
        let scheme = address.scheme();
        let rest = address
            .typed()
            .split_once("://")
            .map_or("", |(_, rest)| rest);
        let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
        if key.contains('*') {
            return Err(Diagnostic::new(
                "a pattern may mean several objects, and one is read here",
            )
            .help("its own key; replay, info, check, report and calibrate take patterns"));
        }
        let is_plain = !rest.contains(['?', '#']);
        let key = Path::parse(key)
            .ok()
            .filter(|key| is_folder || !key.as_ref().is_empty());
        let Some(key) = key.filter(|_| is_plain && !bucket.is_empty()) else {
            return Err(Diagnostic::new("is no address of an object")
                .help(format!("{scheme}://BUCKET/KEY, without a query")));
        };
        let speaker = Speaker {
            client: client::of_cloud(&patience)?,
            patience,
            only_https: false,
            is_without_credentials: Arc::default(),
            is_refused_plain: Arc::default(),
            empty_pages: Arc::default(),
            latest: Arc::default(),
        };
        // Tries are counted by whoever downloads.
        let retry = RetryConfig {
            max_retries: 0,
            ..RetryConfig::default()
        };
        let store: Result<Both, Error> = match scheme.as_str() {
            "s3" => AmazonS3Builder::from_env()
                .with_bucket_name(bucket)
                .with_retry(retry)
                .with_http_connector(speaker.clone())
                .build()
                .map(both),
            "gs" => GoogleCloudStorageBuilder::from_env()
                .with_bucket_name(bucket)
                .with_retry(retry)
                .with_http_connector(speaker.clone())
                .build()
                .map(both),
            _ => MicrosoftAzureBuilder::from_env()
                .with_container_name(bucket)
                .with_retry(retry)
                .with_http_connector(speaker.clone())
                .build()
                .map(both),
        };
        let (store, parts) = store.map_err(|e| {
            Diagnostic::new(format!(
                "the environment does not say how: {}",
                innermost(&e)
            ))
            .help(variables(&scheme))
        })?;
        Ok(Cloud {
            store,
            parts,
            key,
            scheme,
            speaker,
        })
    }

    pub(super) async fn get(&self, range: Range<u64>) -> Result<Reply, Fault> {
        let answered = Arc::new(Answered::default());
        let mut options = GetOptions {
            range: Some(GetRange::Bounded(range.clone())),
            ..GetOptions::default()
        };
        options.extensions.insert(Arc::clone(&answered));
        let found = match self.store.get_opts(&self.key, options).await {
            Ok(found) => found,
            Err(_) if answered.status() == StatusCode::RANGE_NOT_SATISFIABLE.as_u16() => {
                return self.beyond(range).await;
            }
            Err(why) => return Err(self.fault(&why, &answered)),
        };
        Ok(Reply::Part(Part {
            version: Version {
                size: found.meta.size,
                tag: found.meta.e_tag.clone(),
            },
            start: found.range.start,
            body: found
                .into_stream()
                .map(|bytes| bytes.map_err(|e| Fault::passing(broken(&e))))
                .boxed(),
        }))
    }

    /// The keys in the folder that this was made for, of which `most` are looked at, and of those that are `wanted` as
    /// many kept, in no order.
    pub(super) async fn keys(
        &self,
        (most, most_wanted): (usize, usize),
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Keys, Fault> {
        self.ask_anew();
        self.speaker.empty_pages.store(0, Ordering::Relaxed);
        let folder = Some(&self.key).filter(|key| !key.as_ref().is_empty());
        let mut listed = self.store.list(folder);
        let mut keys = Keys::default();
        while let Some(found) = listed.next().await {
            let found = found.map_err(|why| self.fault(&why, &self.speaker.latest))?;
            self.speaker.empty_pages.store(0, Ordering::Relaxed);
            keys.looked_at += 1;
            let key = found.location.as_ref();
            if is_wanted(key) {
                keys.wanted += 1;
                if keys.kept.len() < most_wanted {
                    keys.kept.push(key.to_owned());
                }
            }
            if keys.looked_at >= most {
                break;
            }
        }
        Ok(keys)
    }

    /// Size of the object in bytes; `None` where there is none.
    pub(super) async fn size(&self) -> Result<Option<u64>, Fault> {
        self.ask_anew();
        match self.store.head(&self.key).await {
            Ok(found) => Ok(Some(found.size)),
            Err(Error::NotFound { .. }) => Ok(None),
            Err(why) => Err(self.fault(&why, self.latest())),
        }
    }

    /// Puts an object of one piece there, whole or not at all.
    pub(super) async fn put(&self, bytes: Bytes) -> Result<(), Fault> {
        self.ask_anew();
        let put = self.store.put(&self.key, bytes.into()).await;
        put.map(|_| ())
            .map_err(|why| self.fault(&why, self.latest()))
    }

    /// Begins an object of several parts: by this name of it parts are put, and it is completed or given up.
    pub(super) async fn begin(&self) -> Result<String, Fault> {
        self.ask_anew();
        let begun = self.parts.create_multipart(&self.key).await;
        begun.map_err(|why| self.fault(&why, self.latest()))
    }

    /// Puts the `n`th part of it there, from 0.
    pub(super) async fn part(&self, id: &String, n: usize, bytes: Bytes) -> Result<PartId, Fault> {
        self.ask_anew();
        let put = self.parts.put_part(&self.key, id, n, bytes.into()).await;
        put.map_err(|why| self.fault(&why, self.latest()))
    }

    /// Makes an object of its parts.
    pub(super) async fn complete(&self, id: &String, parts: Vec<PartId>) -> Result<(), Fault> {
        self.ask_anew();
        let made = self.parts.complete_multipart(&self.key, id, parts).await;
        made.map(|_| ())
            .map_err(|why| match self.latest().status() {
                // It answers before it has tried, and says in the body that it failed.
                200 => Fault::passing("the store did not make an object of the parts"),
                _ => self.fault(&why, self.latest()),
            })
    }

    /// Gives up its parts.
    pub(super) async fn give_up(&self, id: &String) -> Result<(), Fault> {
        self.ask_anew();
        let given_up = self.parts.abort_multipart(&self.key, id).await;
        given_up.map_err(|why| self.fault(&why, self.latest()))
    }

    /// Answer to the last request; requests to write follow each other.
    fn latest(&self) -> &Answered {
        &self.speaker.latest
    }

    fn ask_anew(&self) {
        *self.latest().form() = None;
        self.latest().status.store(0, Ordering::Relaxed);
        self.latest().asked_millis.store(0, Ordering::Relaxed);
    }

    /// Reply for an object that has no byte in `range`.
    async fn beyond(&self, range: Range<u64>) -> Result<Reply, Fault> {
        let found = self.store.head(&self.key).await;
        let found = found.map_err(|why| self.fault(&why, &Answered::default()))?;
        Ok(Reply::Part(Part {
            version: Version {
                size: found.size,
                tag: found.e_tag,
            },
            start: range.start,
            body: futures_util::stream::empty().boxed(),
        }))
    }

    fn fault(&self, why: &Error, answered: &Answered) -> Fault {
        let said = match why {
            Error::NotFound { .. } => StatusCode::NOT_FOUND.as_u16(),
            Error::PermissionDenied { .. } => StatusCode::FORBIDDEN.as_u16(),
            Error::Unauthenticated { .. } => StatusCode::UNAUTHORIZED.as_u16(),
            Error::Precondition { .. } | Error::NotModified { .. } => return Fault::changed(),
            _ => answered.status(),
        };
        if let Ok(status) = StatusCode::from_u16(said)
            && !status.is_success()
        {
            let millis = answered.asked_millis.load(Ordering::Relaxed);
            return Fault::status(status, (millis > 0).then(|| Duration::from_millis(millis)));
        }
        if self.speaker.is_without_credentials.load(Ordering::Relaxed) {
            return Diagnostic::new("there are no credentials, and this machine is given none")
                .help(variables(&self.scheme))
                .into();
        }
        if self.speaker.is_refused_plain.load(Ordering::Relaxed) {
            return Diagnostic::new("the environment asks for plain http and does not allow it")
                .help("AWS_ALLOW_HTTP=true, GOOGLE_ALLOW_HTTP=true or AZURE_ALLOW_HTTP=true does")
                .into();
        }
        if let Some(what) = lasting_words(why) {
            return Diagnostic::new(what)
                .help("the address of the store, and of a gateway or proxy before it")
                .into();
        }
        match own_words(why) {
            Some(what) => Fault::passing(what),
            None if answered.form().is_some() => {
                let form = answered.form().clone().unwrap_or_default();
                let form = match form.as_str() {
                    "" => String::new(),
                    form => format!(" ({form})"),
                };
                Diagnostic::new(format!(
                    "what answers there{form} is not what a store says: it cannot be read as XML"
                ))
                .help("the address of the store, and of a gateway or proxy before it")
                .into()
            }
            // What a server of credentials says is not ours to print.
            None => Diagnostic::new("the store cannot be asked with these credentials")
                .help(variables(&self.scheme))
                .into(),
        }
    }

    /// Help for an answer with this status.
    pub(super) fn help(&self, status: u16) -> String {
        match status {
            401 | 403 => variables(&self.scheme).to_owned(),
            404 => format!("bucket and key as in {}://BUCKET/KEY", self.scheme),
            300..=399 => format!(
                "it is in another region or place; {}",
                variables(&self.scheme)
            ),
            _ => String::new(),
        }
    }
}

/// Reason why a body was cut.
fn broken(why: &Error) -> String {
    own_words(why).unwrap_or_else(|| "a body was cut".to_owned())
}

/// Why a request was not answered, where it is we who say so.
fn own_words(why: &Error) -> Option<String> {
    let mut cause: &(dyn std::error::Error + 'static) = why;
    while let Some(next) = cause.source() {
        cause = next;
    }
    let own = cause.downcast_ref::<std::io::Error>();
    own.map(std::string::ToString::to_string)
}

/// The same of what no other try will change.
fn lasting_words(why: &Error) -> Option<String> {
    let mut cause: &(dyn std::error::Error + 'static) = why;
    while let Some(next) = cause.source() {
        cause = next;
    }
    let own = cause.downcast_ref::<std::io::Error>();
    let own = own.filter(|own| own.kind() == std::io::ErrorKind::InvalidData);
    own.map(std::string::ToString::to_string)
}

fn lasting(what: String) -> HttpError {
    let why = std::io::Error::new(std::io::ErrorKind::InvalidData, what);
    HttpError::new(HttpErrorKind::Unknown, why)
}

fn variables(scheme: &str) -> &'static str {
    match scheme {
        "s3" => S3,
        "gs" => GS,
        _ => AZ,
    }
}

impl Answered {
    fn form(&self) -> MutexGuard<'_, Option<String>> {
        // Every change is whole before anything could panic.
        self.form.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn status(&self) -> u16 {
        self.status.load(Ordering::Relaxed)
    }
}

/// Sends what `object_store` asks for.
#[derive(Clone, Debug)]
struct Speaker {
    client: reqwest::Client,
    patience: Patience,
    only_https: bool,
    /// Nobody answered who would give some.
    is_without_credentials: Arc<AtomicBool>,
    is_refused_plain: Arc<AtomicBool>,
    /// Pages of a listing since the last key.
    empty_pages: Arc<AtomicUsize>,
    /// Last answer, for requests that follow each other.
    latest: Arc<Answered>,
}

impl HttpConnector for Speaker {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        let allowed = options.get_config_value(&ClientConfigKey::AllowHttp);
        Ok(HttpClient::new(Speaker {
            only_https: allowed.as_deref() != Some("true"),
            ..self.clone()
        }))
    }
}

/// Whether a request asks what there is: S3 and GCS, Azure.
fn is_listing(url: &reqwest::Url) -> bool {
    url.query_pairs().any(|(name, value)| {
        (name == "list-type" && value == "2") || (name == "comp" && value == "list")
    })
}

/// A future as a trait with async functions has it.
type ResponseFuture<'a> =
    Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'a>>;

impl HttpService for Speaker {
    fn call<'s, 'a>(&'s self, request: HttpRequest) -> ResponseFuture<'a>
    where
        's: 'a,
        Self: 'a,
    {
        Box::pin(self.send(request))
    }
}

impl Speaker {
    async fn send(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let (parts, body) = request.into_parts();
        let refused =
            |why: &str| HttpError::new(HttpErrorKind::Unknown, std::io::Error::other(why));
        let url = parts.uri.to_string();
        let url = reqwest::Url::parse(&url).map_err(|_| refused("is no address"))?;
        let of_machine = url.host_str().is_some_and(|host| {
            let host = host.trim_matches(['[', ']']);
            METADATA.contains(&host)
        });
        if self.only_https && url.scheme() != "https" && !of_machine {
            self.is_refused_plain.store(true, Ordering::Relaxed);
            return Err(refused("plain http is not allowed"));
        }
        let is_listing = is_listing(&url);
        if is_listing && self.empty_pages.fetch_add(1, Ordering::Relaxed) >= MOST_EMPTY {
            return Err(lasting(format!(
                "{MOST_EMPTY} pages of the listing in a row had no key, and the store says that there are more"
            )));
        }
        // Who gives credentials is asked without any.
        let of_store = is_listing || parts.headers.contains_key(reqwest::header::AUTHORIZATION);
        let mut asks = reqwest::Request::new(parts.method, url);
        *asks.headers_mut() = parts.headers;
        *asks.body_mut() = Some(match body.as_bytes() {
            Some(bytes) => reqwest::Body::from(bytes.clone()),
            None => reqwest::Body::wrap(body),
        });
        if of_machine {
            *asks.timeout_mut() = Some(METADATA_ANSWERS);
        }
        let reply = self.client.execute(asks).await.map_err(|why| {
            if of_machine {
                self.is_without_credentials.store(true, Ordering::Relaxed);
            }
            self.error(&why)
        })?;
        if of_machine {
            let is_refused = !reply.status().is_success();
            self.is_without_credentials
                .store(is_refused, Ordering::Relaxed);
        }
        let own = parts.extensions.get::<Arc<Answered>>();
        for answered in own.into_iter().chain([&self.latest]) {
            let asked = asked(reply.headers()).map_or(0, |asked| asked.as_millis());
            let asked = u64::try_from(asked).unwrap_or(u64::MAX);
            answered.asked_millis.store(asked, Ordering::Relaxed);
            let status = reply.status().as_u16();
            answered.status.store(status, Ordering::Relaxed);
            let form = reply.headers().get(reqwest::header::CONTENT_TYPE);
            let form = form.map_or("".into(), |form| String::from_utf8_lossy(form.as_bytes()));
            *answered.form() = of_store.then(|| snippet(form.as_bytes()));
        }
        let (status, headers) = (reply.status(), reply.headers().clone());
        let by = self.clone();
        let body = reqwest::Body::from(reply).map_err(move |why| by.error(&why));
        let body = match is_listing {
            true => HttpResponseBody::new(Limited::new(body, MOST_OF_PAGE).map_err(|why| {
                match why.downcast::<HttpError>() {
                    Ok(own) => *own,
                    Err(_) => lasting(format!(
                        "a page of the listing has more than {} MiB",
                        MOST_OF_PAGE >> 20
                    )),
                }
            })),
            false => HttpResponseBody::new(body),
        };
        let mut out = HttpResponse::new(body);
        *out.status_mut() = status;
        *out.headers_mut() = headers;
        Ok(out)
    }

    fn error(&self, why: &reqwest::Error) -> HttpError {
        let said = match client::fault(why, &self.patience) {
            Fault::Passing { what, .. } => what,
            Fault::Lasting(what) => what.line(),
            Fault::Refused(status) => status.to_string(),
        };
        HttpError::new(HttpErrorKind::Unknown, std::io::Error::other(said))
    }
}
